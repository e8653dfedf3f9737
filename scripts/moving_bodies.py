"""What the registration makes of bodies that move on their own, as a table of docs/accuracy.md: a line for each body."""
import itertools
import statistics

import documents

# Agreement and errors as EVALUATION has them for bodies: targets in a cube of 40 mm about the body's centre.
HALF_CUBE_MM = 20.0
WRONG_MM = 2.0
ALL_ROWS_GOALS = {'false': ('<=', 0.01), 'refused': ('<=', 0.10)}
COLUMNS = [('good', 'good'), ('mtre', 'median mTRE'), ('inplane', 'median in-plane'), ('rotation', 'median rotation'),
           ('accepted', 'accepted'), ('false', 'false acceptance'), ('refused', 'good ones refused'),
           ('agree', 'starts that agree within 0.3 mm')]


def mapped(pose, point):
    return [sum(pose[row][i] * point[i] for i in range(3)) + pose[row][3] for row in range(3)]


def targets(centre):
    return [[c + d for c, d in zip(centre, offset)]
            for offset in itertools.product((-HALF_CUBE_MM, 0.0, HALF_CUBE_MM), repeat=3)]


def distance(a, b):
    return statistics.mean(sum((p - q) ** 2 for p, q in zip(*pair)) ** 0.5 for pair in zip(a, b))


def agreement(trials, body, limit_mm):
    """Share of the results that lie within the limit of their frame's middle one, frame by frame."""
    agree, count = 0, 0
    for frame in {trial['frame'] for trial in trials}:
        found = [trial['bodies'][body] for trial in trials if trial['frame'] == frame]
        points = [[mapped(one['T_camera_ct'], point) for point in targets(one['centre_mm'])] for one in found]
        apart = [[distance(a, b) for b in points] for a in points]
        agree += sum(value <= limit_mm for value in min(apart, key=sum))
        count += len(found)
    return agree / count


def is_good(one, row):
    """Within what the row asks for: mTRE with several views, in-plane with one, which hardly sees depth."""
    error = 'final_mtre' if ',' in row.views else 'final_inplane'
    limits = dict({error: 1.0}, **row.good)
    return all(documents.number(one[key]) < limit for key, limit in limits.items())


def values(row, trials, body):
    all_of_it = [trial['bodies'][body] for trial in trials]
    error = 'final_mtre' if ',' in row.views else 'final_inplane'
    good = [one for one in all_of_it if is_good(one, row)]
    of = len(all_of_it)
    median = lambda key: statistics.median(documents.number(one[key]) for one in all_of_it)
    return {'good': len(good) / of, 'mtre': median('final_mtre'), 'inplane': median('final_inplane'),
            'rotation': median('final_rotation_deg'), 'accepted': sum(one['accepted'] for one in all_of_it) / of,
            'false': sum(one['accepted'] and documents.number(one[error]) > WRONG_MM for one in all_of_it) / of,
            'refused': sum(not one['accepted'] for one in good) / len(good) if good else 0.0,
            'agree': agreement(trials, body, 0.3) if row.real and ',' in row.views else None}


def shown(key, value):
    if key in ('mtre', 'inplane'):
        return '%.3f mm' % value
    return '%.2f°' % value if key == 'rotation' else '%.1f %%' % (100 * value)


def cell(key, value, limits):
    if value is None:
        return ''
    if key not in limits:
        return shown(key, value)
    comparison, limit = limits[key]
    met = value >= limit if comparison == '>=' else value <= limit
    return '%s (%s %s%s)' % (shown(key, value), '≥' if comparison == '>=' else '≤', shown(key, limit),
                             '' if met else ', **missed**')


def table(done):
    lines = []
    for row, report in done:
        trials = report['trials']
        for body in sorted({name for trial in trials for name in trial['bodies']}):
            of_body = [trial for trial in trials if body in trial['bodies']]
            measured, limits = values(row, of_body, body), dict(ALL_ROWS_GOALS, **row.goals)
            lines.append([row.title, row.start_text, body, str(len(of_body))] +
                         [cell(key, measured[key], limits) for key, _ in COLUMNS] +
                         ['%.0f ms' % report['summary']['frame_ms']['median']])
    return documents.table(['session', 'start', 'body', 'trials'] + [title for _, title in COLUMNS] + ['a frame'], lines)


def refusals(done):
    """Why bodies were refused, counted; numbers and names left out."""
    lines = []
    for row, report in done:
        counted = {}
        for trial in report['trials']:
            for body, one in trial['bodies'].items():
                if not one['accepted']:
                    reason = documents.without_numbers(one['reason'].replace(body, 'the body'))
                    counted[reason] = counted.get(reason, 0) + 1
        lines += [[row.title, row.start_text, str(count), reason] for reason, count in sorted(counted.items())]
    if not lines:
        return 'No body was refused.\n'
    return documents.table(['session', 'start', 'refused', 'reason'], lines)
