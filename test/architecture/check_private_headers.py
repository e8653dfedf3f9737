#!/usr/bin/python3
"""Fails when a file includes a private header of another room.

usage: check_private_headers.py <source folder>
Private is every header below src/<room>: it is for that room and for its tests, test/<room> and
test/fuzz/<room>. What another room may use
stands in include/xray_registration/<room>, and is included as that: `xray_registration/<room>/<name>.h`. A path that
reaches the same file in another way (`../drr/engine.h`) would pass by check_rooms.sh, and fails here.
"""
import os
import re
import sys

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*[<"]([^">]+)[">]', re.MULTILINE)
SOURCES = ('.cpp', '.h', '.hpp')
# What is compiled, and the folder's room when it has only one.
FOLDERS = {'src': None, 'include/xray_registration': None, 'test': None, 'benchmark': 'tools'}


def room_of(path):
    """(room, whether it is private) of a path below the source folder; None for a path in no room."""
    for folder, private in (('src', True), ('include/xray_registration', False)):
        if path.startswith(folder + '/'):
            rest = path[len(folder) + 1:].split('/')
            return (rest[0], private) if len(rest) > 1 else (None, private)
    return None, False


def files(root):
    """(path below root, room that it belongs to) of every source file."""
    for folder, room in FOLDERS.items():
        for base, _, names in os.walk(os.path.join(root, folder)):
            for name in sorted(names):
                if name.endswith(SOURCES):
                    path = os.path.relpath(os.path.join(base, name), root)
                    places = os.path.relpath(path, folder).split('/')
                    # The fuzzers of a room stand in its folder below test/fuzz.
                    yield path, room or (places[1] if places[0] == 'fuzz' else places[0])


def target(root, path, included):
    """The file of this package that an #include means, below root; None for any other. Looked for as the compiler does:
    beside the file, then in every folder that a target of this package has in its include path."""
    for folder in (os.path.dirname(path), 'src', 'include', '.'):
        candidate = os.path.normpath(os.path.join(folder, included))
        if os.path.isfile(os.path.join(root, candidate)):
            return candidate
    return None


def complaint(root, path, room, included):
    """What is wrong with one #include; None when nothing is."""
    found = target(root, path, included)
    if found is None:
        return None
    owner, private = room_of(found)
    if owner is None or owner == room:
        return None
    if private:
        return "%s is private to room '%s'" % (included, owner)
    if found != 'include/' + included:
        return "%s: a public header is included as %s" % (included, found[len('include/'):])
    return None


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    root = os.path.abspath(sys.argv[1])
    checked, wrong = 0, 0
    for path, room in files(root):
        checked += 1
        with open(os.path.join(root, path), encoding='utf-8') as file:
            text = file.read()
        for match in INCLUDE.finditer(text):
            said = complaint(root, path, room, match.group(1))
            if said:
                wrong += 1
                print('%s:%d: %s' % (path, text.count('\n', 0, match.start(1)) + 1, said))
    if checked == 0:
        print('%s holds no source file' % root)
        wrong = 1
    if wrong == 0:
        print('private headers: none of %d files includes that of another room' % checked)
    return 1 if wrong else 0


if __name__ == '__main__':
    sys.exit(main())
