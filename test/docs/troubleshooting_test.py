#!/usr/bin/python3
"""Every text that the rooms print can be found in docs/troubleshooting.md.

A text is a string of the sources that holds at least three words: what only names something (a parameter, a header, a
file) does not. What stands between strings of one message (a name, a number) is `…` on the page.

usage: troubleshooting_test.py
"""
import glob
import os
import re
import sys
import unittest

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..')
PAGE = os.path.join(ROOT, 'docs', 'troubleshooting.md')
# Command-line tools name their option and have --help; evaluation is theirs alone.
ROOMS = ('common', 'drr', 'geometry', 'image', 'pipeline', 'registration', 'ros', 'volume')
# Strings that are not for people to read in trouble: what a compiler is told, what is written into files.
SILENT = (
    re.compile(r'^-cl-std=|^#line '), re.compile(r'^xray_registration undistortion map 1$'),
    re.compile(r'^(raw = straight|1, x, y|corners u, v)'),
    re.compile(r'^Incomplete Pixel Data$'),  # GDCM's, which is kept quiet.
)
STRING = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
FORMAT = re.compile(r'%[-+#0]*[0-9.*]*[a-z]+')


def without_comments(code):
    code = re.sub(r'^\s*#include.*$', '', code, flags=re.MULTILINE)
    code = re.sub(r'static_assert\([^;]*;', '', code)
    return re.sub(r'("(?:[^"\\\n]|\\.)*")|//[^\n]*', lambda match: match.group(1) or '', code)


def is_text(string):
    return len(string.split()) >= 3 and len(re.findall(r'[A-Za-z]{2,}', string)) >= 3


def texts(code):
    """The texts of a source, without what is filled in."""
    joined = re.sub(r'"\s*"', '', without_comments(code))
    found = []
    for string in STRING.findall(joined):
        string = string.replace('\\"', '"').replace('\\n', ' ')
        if any(silent.search(string) for silent in SILENT):
            continue
        # A word beside a number that is filled in is no text by itself, but is one with the rest of its string.
        if is_text(FORMAT.sub('x', string)):
            found.append('…'.join(FORMAT.split(string)).strip(" :;,'"))
    return found


def page_text(page):
    return re.sub(r'\s+', ' ', page.replace('`', '').replace('\\|', '|'))


class TroubleshootingTest(unittest.TestCase):
    def test_every_text_is_on_the_page(self):
        with open(PAGE, encoding='utf-8') as file:
            page = page_text(file.read())
        missing, count = [], 0
        for room in ROOMS:
            for path in sorted(glob.glob(os.path.join(ROOT, 'src', room, '**', '*'), recursive=True)):
                if not path.endswith(('.cpp', '.h')):
                    continue
                with open(path, encoding='utf-8') as file:
                    code = file.read()
                for text in texts(code):
                    count += 1
                    if re.sub(r'\s+', ' ', text) not in page:
                        missing.append('%s: %s' % (os.path.relpath(path, ROOT), text))
        self.assertGreater(count, 400)  # Else nothing was collected.
        self.assertEqual(missing, [], 'write down in docs/troubleshooting.md what to do about\n' + '\n'.join(missing))

    def test_texts_are_told_from_names(self):
        code = '''#include "xray_registration/one/two_three.h"
            // "a comment is no text"
            throw Error("the image's size is " + size +
                        ", not that "
                        "of its mask");
            group.number("max_jump_mm", 0.1); log("turned by %.0f degrees about %s axes"); static_assert(a, "no one reads this");
            '''
        self.assertEqual(texts(code), ["the image's size is", 'not that of its mask', 'turned by … degrees about … axes'])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
