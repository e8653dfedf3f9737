"""What the verdict makes of wrong inputs, as tables of docs/accuracy.md."""
import math
import statistics

import documents
from accuracy_rows import WRONG

# Words that the reason of a refusal has when it names the suspicion. A body of another size is another patient's too.
WORDS = {'focal_length': ['focal length'], 'principal_point': ['principal point'], 'distortion': ['distortion'],
         'view_pose': ['pose of the view'], 'ct_scale': ['size of the CT', 'another patient'],
         'mirrored_image': ['mirrored'], 'turned_image': ['turned'], 'inverted_image': ['inverted'],
         'exchanged_views': ['exchanged'], 'mirrored_ct': ['mirrored'], 'other_patient': ['another patient']}
LIMIT_MM = 1.0
# What one view takes for depth.
DEPTH = ('focal', 'size', 'size_2')


def is_false(trial, row):
    """Accepted and off by more than the limit: in-plane for one view, which hardly sees depth."""
    error = 'final_mtre' if ',' in row.views else 'final_inplane'
    return trial['accepted'] and documents.number(trial[error]) > LIMIT_MM


def names(trial, suspicions):
    # "The pose turned … degrees from the start" is no suspicion of the X-ray.
    reason = trial['reason'].replace('the pose turned', '')
    return any(words in reason for what in suspicions for words in WORDS[what])


def line(row, report):
    trials = report['trials']
    accepted = [trial for trial in trials if trial['accepted']]
    refused = [trial for trial in trials if not trial['accepted']]
    errors = [documents.number(trial['final_mtre']) for trial in accepted]
    inplane = [documents.number(trial['final_inplane']) for trial in accepted]
    named = sum(names(trial, [wrong['what'] for wrong in report['wrong']]) for trial in refused)
    false = sum(is_false(trial, row) for trial in trials)
    return [row.title, WRONG[row.wrong][1], str(len(report['summary']['views'])), str(len(trials)), str(len(accepted)),
            '%d%s' % (false, ' (≤ 0, **missed**)' if false else ''),
            '%.2f / %.2f mm' % (max(errors), statistics.median(errors)) if accepted else '',
            '%.2f mm' % statistics.median(inplane) if accepted else '',
            '%d of %d' % (named, len(refused)) if refused else '']


def table(done):
    return documents.table(['session', 'what is wrong', 'views', 'trials', 'accepted', 'false acceptance',
                            'error of what was accepted, worst / median', 'median in-plane', 'refusals that name it'],
                           [line(row, report) for row, report in done])


def left_to_move(trial):
    """The suspicion that says what no pose moves away, of a trial that was looked at; else None."""
    found = [one for one in trial['suspicions'] if one['what'] == 'other_patient' and one['unit'] == 'mm']
    return found[0] if found else None


def left(done):
    """What no pose moves away, by row: right inputs first. Only what looks right otherwise is asked for it."""
    lines = []
    for row, report in done:
        looked = [one for one in map(left_to_move, report['trials']) if one]
        if row.is_far or not looked:
            continue
        values = [one['estimate'] for one in looked]
        lines.append([row.title, WRONG[row.wrong][1] if row.wrong else '%s' % row.start_text, str(len(looked)),
                      '%.3f mm' % statistics.median(values), '%.3f mm' % max(values),
                      '%.3f mm' % statistics.median(one['sigma'] for one in looked),
                      '%d of %d' % (sum(one['certain'] for one in looked), len(looked))])
    return documents.table(['session', 'start, or what is wrong', 'trials that were looked at', 'median', 'largest', 'its σ',
                            'above 6 σ'], lines)


def depth(done):
    """One view hardly tells a focal length or a size from depth: whether the covariance has what it cannot tell."""
    lines = []
    for row, report in done:
        if ',' in row.views or row.wrong not in DEPTH:
            continue
        trials = [trial for trial in report['trials'] if documents.number(trial['final_inplane']) <= LIMIT_MM]
        if not trials:
            continue
        errors = [math.sqrt(max(trial['final_mtre'] ** 2 - trial['final_inplane'] ** 2, 0)) for trial in trials]
        sigmas = [trial['depth_sigma_mm'] for trial in trials]
        lines.append([row.title, WRONG[row.wrong][1], '%d of %d' % (len(trials), len(report['trials'])),
                      '%.1f mm' % statistics.median(errors), '%.1f mm' % statistics.median(sigmas),
                      '%.2f' % max(error / sigma for error, sigma in zip(errors, sigmas))])
    return documents.table(['session', 'what is wrong', 'in-plane within 1 mm', 'error in depth, median', 'its σ, median',
                            'largest error / σ'], lines)


def share(count, of):
    return '%d of %d (%.1f %%)' % (count, of, 100 * count / of) if of else ''


def kinds(done):
    """False acceptance of right starts, wrong starts and wrong inputs apart; what the verdict costs good results."""
    lines = []
    for title, belongs in (('right inputs, near starts and tracking', lambda row: not row.wrong and not row.is_far),
                           ('right inputs, far starts', lambda row: row.is_far),
                           ('wrong inputs', lambda row: row.wrong)):
        trials = [(row, trial) for row, report in done if belongs(row) for trial in report['trials']]
        false = sum(is_false(trial, row) if row.wrong else trial['accepted'] and trial['wrong'] for row, trial in trials)
        good = [trial for row, trial in trials if trial['success'] and not row.wrong]
        refused = [trial for trial in good if not trial['accepted']]
        lines.append([title, str(len(trials)), str(sum(trial['accepted'] for _, trial in trials)),
                      share(false, len(trials)), share(len(refused), len(good)),
                      share(sum(names(trial, WORDS) for trial in refused), len(good))])
    return documents.table(['', 'trials', 'accepted', 'false acceptance', 'good ones refused', 'for a suspicion'], lines)
