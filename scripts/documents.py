"""What the measuring scripts share: their arguments, running a tool, tables, and where results stand in the documents."""
import argparse
import datetime
import json
import math
import os
import platform
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


class Script:
    """A script's name, arguments and folder: `arguments` has data, tools, output, write_docs, load and what was added."""

    def __init__(self, name, doc, data_required=True, add=lambda parser: None):
        parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
        parser.add_argument('--data', default=os.environ.get('XRAY_REGISTRATION_DATA'),
                            help='folder with ct/, sessions/ and wrist/ (default: $XRAY_REGISTRATION_DATA)')
        parser.add_argument('--output', default=os.path.join(ROOT, 'build', name))
        parser.add_argument('--tools', default=os.path.join(ROOT, 'build', 'devel', 'lib', 'xray_registration'),
                            help='folder of the executables')
        parser.add_argument('--write-docs', action='store_true', help='put the results into docs/ and the README')
        add(parser)
        self.name, self.arguments = name, parser.parse_args()
        self.arguments.load = os.getloadavg()[0]
        if (self.arguments.data or data_required) and not os.path.isdir(self.arguments.data or ''):
            parser.error('--data or XRAY_REGISTRATION_DATA must name the folder with ct/, sessions/ and wrist/')
        if not os.access(self.tool('evaluate'), os.X_OK):
            parser.error('no tools in %s; build first (scripts/build) or name the folder' % self.arguments.tools)
        os.makedirs(self.arguments.output, exist_ok=True)

    def tool(self, name):
        return os.path.join(self.arguments.tools, name)

    def data(self, name):
        return os.path.join(self.arguments.data, name)

    def output(self, name):
        return os.path.join(self.arguments.output, name)

    def run(self, tool, *words, log=None):
        """Runs a tool, showing the command as the documents do; what it says goes to `log` when one is named."""
        line = [self.tool(tool)] + [str(word) for word in words]
        print('$ ' + ' '.join(line), flush=True)
        with open(self.output(log) if log else os.devnull, 'w') as file:
            code = subprocess.run(line, stdout=file if log else None).returncode
        if code != 0:
            sys.exit('%s: %s failed with exit code %d' % (self.name, tool, code))

    def report(self, tool, name, *words, **more):
        """Runs a tool with --json NAME.json; returns what it wrote."""
        self.run(tool, *words, '--json', self.output(name + '.json'), **more)
        return load(self.output(name + '.json'))


def load(path):
    with open(path, encoding='utf-8') as file:
        return json.load(file)


def number(value):
    """JSON has no infinity; the tools write null for it."""
    return math.inf if value is None else value


def without_numbers(reason):
    """A reason without its numbers and what stands behind a colon, so that equal causes are counted together."""
    return re.sub('[0-9]+([.][0-9]+)?', '…', reason.split(':')[0])


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
    with open(path, encoding='utf-8') as file:
        text = file.read()
    for name, content in made.items():
        begin, end = '<!-- begin %s -->' % name, '<!-- end %s -->' % name
        if begin not in text or end not in text:
            sys.exit('%s has no place for "%s"' % (path, name))
        head, rest = text.split(begin, 1)
        text = head + begin + '\n' + content + end + rest.split(end, 1)[1]
    with open(path, 'w', encoding='utf-8') as file:
        file.write(text)
