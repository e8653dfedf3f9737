"""What the measuring scripts share: tables, the machine in words, and where results stand in the documents."""
import datetime
import os
import platform
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def table(titles, rows):
    lines = ['| ' + ' | '.join(titles) + ' |', '|' + ' --- |' * len(titles)]
    return '\n'.join(lines + ['| ' + ' | '.join(row) + ' |' for row in rows]) + '\n'


def processor():
    for line in open('/proc/cpuinfo'):
        if line.startswith('model name'):
            return line.split(':', 1)[1].strip()
    return platform.processor()


def system():
    try:
        return re.search('^PRETTY_NAME="?([^"\n]*)', open('/etc/os-release').read(), re.M).group(1)
    except (OSError, AttributeError):
        return platform.platform()


def machine(device='', load=None):
    """One line: processor, device, system, load and date."""
    words = ['%s, %d cores' % (processor(), os.cpu_count()), device, system()]
    if load is not None:
        words.append('load before the run %.2f' % load)
    return ', '.join(word for word in words if word) + '; %s.\n' % datetime.date.today().isoformat()


def put(path, made):
    """Replaces what stands between <!-- begin NAME --> and <!-- end NAME --> in a file of the checkout."""
    path = os.path.join(ROOT, path)
    with open(path) as file:
        text = file.read()
    for name, content in made.items():
        begin, end = '<!-- begin %s -->' % name, '<!-- end %s -->' % name
        if begin not in text or end not in text:
            sys.exit('%s has no place for "%s"' % (path, name))
        head, rest = text.split(begin, 1)
        text = head + begin + '\n' + content + end + rest.split(end, 1)[1]
    with open(path, 'w') as file:
        file.write(text)
