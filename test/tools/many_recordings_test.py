#!/usr/bin/python3
"""Several recordings by two workers at a time, as docs/scaling.md says, give the same bytes of pose as one by one.

usage: many_recordings_test.py --tools FOLDER --work FOLDER
The workers of register_bag are GNU parallel's where it is installed, those of evaluate are xargs'.
"""
import argparse
import json
import os
import shlex
import shutil
import subprocess
import sys

import tool_case

SESSIONS = ('first', 'second', 'third')


class ManyRecordings(tool_case.ToolTest):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(cls.work_folder)
        os.makedirs(cls.work_folder)
        cls.tool('make_phantom', '--phantom', 'head', '--spacing', 3, '--output', cls.work('head.nii.gz'))
        for seed, name in enumerate(SESSIONS):
            cls.tool('simulate_session', '--ct', cls.work('head.nii.gz'), '--frames', 3, '--size', 96, '--seed', seed,
                     '--amplitude-deg', 3, '--amplitude-mm', 5, '--output', cls.work(name + '.bag'))

    def command(self, tool, *words):
        return [os.path.join(self.folder, tool), '--ct', self.work('head.nii.gz')] + [str(word) for word in words]

    def by_two_workers(self, line, arguments, parallel):
        """Runs `line` for each argument, which stands in it as {}; returns how many workers took part."""
        kernels = self.work('kernels_')
        shutil.rmtree(kernels + '1', ignore_errors=True)
        shutil.rmtree(kernels + '2', ignore_errors=True)
        text = ' '.join(word if word == '{}' else shlex.quote(word) for word in line)
        if parallel:
            script = 'mkdir -p %s{%%}; POCL_MAX_PTHREAD_COUNT=1 POCL_CACHE_DIR=%s{%%} %s' % (kernels, kernels, text)
            workers = ['parallel', '--will-cite', '-j2', script, ':::'] + arguments
            told = ''
        else:
            script = 'n=$((SLOT + 1)); mkdir -p %s$n; POCL_MAX_PTHREAD_COUNT=1 POCL_CACHE_DIR=%s$n %s' % (
                kernels, kernels, text.replace('{}', '"$1"'))
            workers = ['xargs', '-P2', '-n1', '--process-slot-var=SLOT', 'sh', '-ec', script, 'sh']
            told = '\n'.join(arguments)
        done = subprocess.run(workers, input=told, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=self.timeout_s,
                              universal_newlines=True)
        self.assertEqual(done.returncode, 0, done.stdout)
        return sum(os.path.isdir(kernels + number) for number in '12')

    def numbers_as_written(self, name, keys, entries):
        """What stands under these keys in every entry of a report, numbers as their text."""
        with open(self.work(name)) as file:
            made = json.load(file, parse_float=str, parse_int=str)
        return [[entry[key] for key in keys] for entry in made[entries]]

    def test_register_bag(self):
        def line(folder, bag):
            # In GNU parallel's words {/.} would be the name; a shell has it where xargs works.
            return ['sh', '-ec', 'name=$(basename "$1" .bag); folder=$2; shift 2; '
                    'exec "$@" --output "$folder/$name.bag" --json "$folder/$name.json" --bag "%s/$name.bag"' % self.work_folder,
                    'sh', bag, folder] + self.command('register_bag', '--initial-pose-topic', '/ap/ground_truth',
                                                      '--disturb', '2,3')
        for folder in ('one', 'two'):
            os.makedirs(self.work(folder))
        bags = [self.work(name + '.bag') for name in SESSIONS]
        for bag in bags:
            subprocess.run(line(self.work('one'), bag), check=True, timeout=self.timeout_s, stdout=subprocess.DEVNULL)
        self.assertEqual(self.by_two_workers(line(self.work('two'), '{}'), bags, shutil.which('parallel')), 2)
        seen = set()
        for name in SESSIONS:
            keys = ('stamp', 'accepted', 'T_camera_ct', 'covariance', 'iterations', 'similarity')
            alone = self.numbers_as_written('one/%s.json' % name, keys, 'frames')
            self.assertEqual(len(alone), 3)
            self.assertEqual(self.numbers_as_written('two/%s.json' % name, keys, 'frames'), alone)
            self.assertTrue(all(accepted for _, accepted, *_ in alone))
            seen.add(str(alone))
        self.assertEqual(len(seen), len(SESSIONS), 'sessions that are all the same would show nothing')

    def test_evaluate(self):
        if not os.path.exists(os.path.join(self.folder, 'evaluate')):
            self.skipTest('a build with sanitizers has no evaluate')
        def line(folder, seed):
            return ['sh', '-ec', 'seed=$1; folder=$2; shift 2; exec "$@" --seed $seed --json "$folder/trials_$seed.json"', 'sh',
                    seed, folder] + self.command('evaluate', '--bag', self.work('first.bag'), '--trials', 2, '--rotation', 4,
                                                 '--translation', 5)
        for folder in ('trials_one', 'trials_two'):
            os.makedirs(self.work(folder))
        seeds = ['1', '2']
        for seed in seeds:
            subprocess.run(line(self.work('trials_one'), seed), check=True, timeout=self.timeout_s,
                           stdout=subprocess.DEVNULL)
        self.assertEqual(self.by_two_workers(line(self.work('trials_two'), '{}'), seeds, False), 2)
        keys = ('start_mtre', 'final_mtre', 'accepted', 'T_camera_ct')
        alone = [self.numbers_as_written('trials_one/trials_%s.json' % seed, keys, 'trials') for seed in seeds]
        self.assertEqual([self.numbers_as_written('trials_two/trials_%s.json' % seed, keys, 'trials') for seed in seeds],
                         alone)
        self.assertNotEqual(alone[0], alone[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tool_case.add_folders(parser)
    arguments = parser.parse_args()
    os.makedirs(arguments.work, exist_ok=True)
    return tool_case.run(ManyRecordings, arguments)


if __name__ == '__main__':
    sys.exit(main())
