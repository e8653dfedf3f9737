"""What scripts/soak calls growth, and its figures by the minute."""
import statistics

# What a node needs once (kernels, pools, caches, the largest CT) it has after this share of the run.
WARM_UP = 0.25

# Name, unit, quantile that is compared, and by how much it may be more in the last third than in the first one after the
# warm-up. Memory: the low quantile is what stays when a CT that is being loaded is gone. A node that loses an image, a
# level of a CT or a result of a frame loses more than this within a minute; the allocator's own pools, into which
# threads cut what they return, were seen to waver by 13 MiB. Descriptors: a service's caller, a subscriber or a file
# that is just being read may be there in one third and not in the other. Threads: there are as many as there are queues,
# and the median does not see one that makes a surface for a moment.
RULES = [('rss_mib', 'MiB', 0.1, 16.0), ('descriptors', 'descriptors', 0.5, 3), ('threads', 'threads', 0.5, 1)]


def quantile(values, share):
    """The smallest value that at least this share of them does not exceed."""
    ordered = sorted(values)
    return ordered[max(0, min(len(ordered) - 1, int(round(share * len(ordered) + 0.4999)) - 1))]


def thirds(seconds, values):
    """The first and the last third of what comes after the warm-up."""
    begin = seconds[0] + WARM_UP * (seconds[-1] - seconds[0])
    third = (seconds[-1] - begin) / 3
    early = [value for at, value in zip(seconds, values) if begin <= at <= begin + third]
    late = [value for at, value in zip(seconds, values) if at >= seconds[-1] - third]
    return early, late


def growth(samples):
    """By rule's name: what was compared, and whether it grew. `samples` has lists: seconds, and one for each rule."""
    found = {}
    for name, unit, share, limit in RULES:
        if len(samples['seconds']) < 6:
            continue
        early, late = (quantile(values, share) for values in thirds(samples['seconds'], samples[name]))
        found[name] = {'unit': unit, 'first_third': early, 'last_third': late, 'limit': limit, 'grew': late - early > limit}
    return found


def in_words(name, found):
    return '%s: from %.1f to %.1f %s, allowed are %g more' % (
        name, found['first_third'], found['last_third'], found['unit'], found['limit'])


def table(report):
    """Titles and rows for the documents, of what scripts/soak wrote."""
    rows = []
    for name, node in sorted(report['nodes'].items()):
        frames, grown = node['frames'], node['growth']
        change = lambda rule, form: '%s → %s' % (form % grown[rule]['first_third'], form % grown[rule]['last_third'])
        spread = lambda key: '%.0f ms (%.0f to %.0f)' % of_minutes([row[key] for row in node['minutes']])
        rows.append(['%s (%s)' % (name, ', '.join(node['views'])), '%d' % frames['received'], '%d' % frames['accepted'],
                     '%d' % frames['refused'], '%d' % frames['dropped'], '%d' % node['wrong_poses'],
                     '%.2f mm, %.2f mm' % (node['worst_mtre_mm'], node['worst_inplane_mm']),
                     change('rss_mib', '%.0f') + ' MiB', change('descriptors', '%d'), change('threads', '%d'),
                     spread('latency_median_ms'), spread('latency_p99_ms')])
    return ['node (views)', 'images', 'accepted', 'refused', 'dropped', 'wrong poses', 'farthest off: mTRE, in-plane',
            'memory', 'descriptors', 'threads', 'median latency of a minute', 'p99 of a minute'], rows


def of_minutes(values):
    """Median, least and largest."""
    known = [value for value in values if value is not None] or [float('nan')]
    return statistics.median(known), min(known), max(known)


class Minutes:
    """Answers by the minute: how many were accepted, refused, dropped, and how late the accepted ones were."""

    def __init__(self):
        self.minutes = []

    def add(self, seconds, outcome, latency_s=None):
        while len(self.minutes) <= int(seconds // 60):
            self.minutes.append({'accepted': 0, 'refused': 0, 'dropped': 0, 'latencies': []})
        self.minutes[int(seconds // 60)][outcome] += 1
        if latency_s is not None:
            self.minutes[int(seconds // 60)]['latencies'].append(1e3 * latency_s)

    def report(self):
        rows = []
        for minute in self.minutes:
            row = {name: minute[name] for name in ('accepted', 'refused', 'dropped')}
            latencies = minute['latencies']
            row['latency_median_ms'] = statistics.median(latencies) if latencies else None
            row['latency_p99_ms'] = quantile(latencies, 0.99) if latencies else None
            rows.append(row)
        return rows
