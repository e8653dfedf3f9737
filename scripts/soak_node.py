"""A node of scripts/soak: its process, what it uses, and what it answers."""
import os
import signal
import subprocess
import sys
import threading
import time

import numpy
import rospy
import yaml
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import SetBool, Trigger
from xray_registration.msg import RegistrationStatus
from xray_registration.srv import LoadCt, SetInitialPose, SetInitialPoseRequest

import documents
import soak_camera
import soak_rules

# A pose is wrong when it is farther off than what the project calls a false acceptance, or, as an image shows it, than
# anything that it calls a good one: `evaluate`'s criteria are 5 mm and 0.5 mm. One view hardly sees depth: twice as much.
WRONG_MM = {1: 10.0, 2: 5.0}
WRONG_INPLANE_MM = 1.0
LOST_S = 5.0               # Somebody sees that it is lost, and gives a start.
RECOVERS_WITHIN_S = 180.0  # A machine with a lot else to do builds kernels for a minute.
ENDS_WITHIN_S = 15.0       # roslaunch's patience.
TARGETS_MM = numpy.array([[x, y, z, 0.0] for x in (-50, 0, 50) for y in (-50, 0, 50) for z in (-50, 0, 50)])


def error_mm(found, truth, centre):
    """Mean distance of targets around the head's centre, and the same as the first view's image shows it."""
    targets = TARGETS_MM + numpy.append(centre, 1.0)
    apart = ((found - truth) @ targets.T)[:3]
    return float(numpy.linalg.norm(apart, axis=0).mean()), float(numpy.linalg.norm(apart[:2], axis=0).mean())


class Node:
    def __init__(self, name, views, cts, camera, folder, executable):
        self.name, self.views, self.cts, self.camera = name, views, cts, camera
        self.samples = {'seconds': [], 'rss_mib': [], 'descriptors': [], 'threads': []}
        self.minutes, self.lock = soak_rules.Minutes(), threading.Lock()
        self.state, self.lost_since, self.starts, self.frames = None, None, 0, None
        self.wrong, self.worst, self.published, self.reasons, self.twice = [], [0.0, 0.0], set(), {}, 0
        self.loaded, self.exit_code, self.began, self.log_path = 0, None, None, os.path.join(folder, name + '.log')
        # The middle of the beam, where the head's centre is on the whole.
        self.centre = numpy.mean([T[:3, :3].T @ ([0, 0, 800.0] - T[:3, 3]) for T in camera.session.T_camera_ct], axis=0)
        self.configure(folder)
        line = [executable, '__name:=' + name]
        if len(views) == 1:
            line += ['image_raw:=/%s/image_raw' % views[0]]
        cache = os.path.join(folder, 'pocl_' + name)
        os.makedirs(cache, exist_ok=True)
        self.log = open(self.log_path, 'w')
        self.process = subprocess.Popen(line, stdout=self.log, stderr=self.log, env=dict(os.environ, POCL_CACHE_DIR=cache))
        rospy.Subscriber('/%s/status' % name, RegistrationStatus, self.on_status, queue_size=1000)
        rospy.Subscriber('/%s/pose' % name, PoseWithCovarianceStamped, self.on_pose, queue_size=1000)

    def configure(self, folder):
        parameters = {'ct': {'path': self.cts[0]}, 'frames': {'ct': 'ct_' + self.name}}
        if len(self.views) > 1:
            parameters['views'] = self.views
        rospy.set_param('/' + self.name, parameters)
        with open(os.path.join(folder, self.name + '.yaml'), 'w') as file:
            yaml.safe_dump(parameters, file)

    def call(self, service, kind, *arguments, **named):
        return rospy.ServiceProxy('/%s/%s' % (self.name, service), kind)(*arguments, **named)

    def wait_until_ready(self):
        rospy.wait_for_service('/%s/load_ct' % self.name, timeout=120)
        end = time.monotonic() + 120
        while not self.load(0).success:  # Until the CT that it starts with is there, it refuses.
            if time.monotonic() > end or self.process.poll() is not None:
                raise SystemExit('soak: the node %s does not start; what it said is in %s' % (self.name, self.log_path))
            time.sleep(0.5)

    # What it answers.
    def seconds(self):
        if self.began is None:
            self.began = time.monotonic()
        return time.monotonic() - self.began

    def on_status(self, status):
        ahead_s = self.camera.shown.get(status.header.stamp.to_nsec(), (None, 0.0))[1]
        outcome = 'accepted' if status.accepted else 'dropped' if status.reason.startswith('dropped') else 'refused'
        with self.lock:
            self.minutes.add(self.seconds(), outcome, status.latency + ahead_s if status.accepted else None)
            if outcome == 'refused':
                reason = documents.without_numbers(status.reason)
                self.reasons[reason] = self.reasons.get(reason, 0) + 1
        self.frames = {name: getattr(status, 'frames_' + name) for name in ('received', 'accepted', 'refused', 'dropped')}
        self.state = status.state
        searching = status.state in (RegistrationStatus.WAITING_FOR_POSE, RegistrationStatus.LOST, RegistrationStatus.FAULT)
        if not searching:
            self.lost_since = None
        elif self.lost_since is None:
            self.lost_since = time.monotonic()

    def on_pose(self, message):
        stamp = message.header.stamp.to_nsec()
        truth = self.camera.shown.get(stamp, (None, 0.0))[0]
        with self.lock:
            if stamp in self.published:
                self.twice += 1
            self.published.add(stamp)
            if truth is None:
                self.note_wrong(stamp, 'of an image that could not be used')
                return
            mtre, inplane = error_mm(soak_camera.matrix(message.pose.pose), truth, self.centre)
            self.worst = [max(self.worst[0], mtre), max(self.worst[1], inplane)]
            if mtre > WRONG_MM[len(self.views)] or inplane > WRONG_INPLANE_MM:
                self.note_wrong(stamp, '%.2f mm off, %.2f mm in the image' % (mtre, inplane))

    def note_wrong(self, stamp, why):
        self.wrong.append({'stamp_ns': stamp, 'seconds': self.seconds(), 'why': why})
        print('soak: %s, %.0f s: a wrong pose was accepted: %s' % (self.name, self.seconds(), why), file=sys.stderr)

    # What is asked of it.
    def give_start(self, off_mm=2.0):
        """About where the patient is now."""
        request = SetInitialPoseRequest()
        request.pose.header.frame_id = self.camera.session.frame_id
        pose = self.camera.truth_now()
        request.pose.pose.orientation = pose.orientation
        request.pose.pose.position.x = pose.position.x + 1e-3 * off_mm
        request.pose.pose.position.y = pose.position.y - 1e-3 * off_mm
        request.pose.pose.position.z = pose.position.z
        return self.call('set_initial_pose', SetInitialPose, request)

    def start_if_lost(self):
        if self.lost_since is None or time.monotonic() - self.lost_since < LOST_S:
            return
        self.lost_since = None
        self.starts += 1
        self.give_start()

    def until_tracking(self, when):
        """Gives starts until it tracks the CT. Returns what went wrong."""
        end, poses = time.monotonic() + RECOVERS_WITHIN_S, len(self.published)
        while time.monotonic() < end and self.process.poll() is None:
            if self.state == RegistrationStatus.TRACKING and len(self.published) > poses:
                return []
            self.start_if_lost()
            time.sleep(0.1)
        return ['the node %s does not track %s' % (self.name, when)] if self.process.poll() is None else []

    def reset(self):
        return self.call('reset', Trigger)

    def enable(self, on):
        return self.call('set_enabled', SetBool, on)

    def load(self, which):
        self.loaded = which % len(self.cts)
        return self.call('load_ct', LoadCt, path=self.cts[self.loaded])

    def load_other(self):
        return self.load(self.loaded + 1)

    def load_path(self, path):
        return self.call('load_ct', LoadCt, path=path)

    # What it uses.
    def sample(self, seconds):
        folder = '/proc/%d/' % self.process.pid
        try:
            with open(folder + 'statm') as file:
                pages = int(file.read().split()[1])
            counts = [len(os.listdir(folder + name)) for name in ('fd', 'task')]
        except (OSError, IndexError, ValueError):
            return  # It is gone, which is seen elsewhere.
        values = [seconds, pages * os.sysconf('SC_PAGESIZE') / 2.0 ** 20] + counts
        for name, value in zip(('seconds', 'rss_mib', 'descriptors', 'threads'), values):
            self.samples[name].append(value)

    def in_words(self):
        rss = self.samples['rss_mib'][-1] if self.samples['rss_mib'] else 0.0
        frames = self.frames or {'accepted': 0, 'received': 0}
        return '%d of %d accepted, %.0f MiB, %d wrong' % (frames['accepted'], frames['received'], rss, len(self.wrong))

    # How it ends.
    def end(self):
        """Ends it as roslaunch does. Returns what went wrong."""
        code = self.process.poll()
        if code is not None:
            self.exit_code = code
            return ['the node %s died with %d; what it said is in %s' % (self.name, code, self.log_path)]
        self.process.send_signal(signal.SIGINT)
        try:
            self.exit_code = self.process.wait(timeout=ENDS_WITHIN_S)
        except subprocess.TimeoutExpired:
            return ['the node %s did not end within %g s' % (self.name, ENDS_WITHIN_S)]
        return [] if self.exit_code == 0 else ['the node %s ended with %d' % (self.name, self.exit_code)]

    def failures(self):
        found = soak_rules.growth(self.samples)
        said = ['%s: %s' % (self.name, soak_rules.in_words(name, one)) for name, one in found.items() if one['grew']]
        if self.wrong:
            said.append('%s: %d wrong poses were accepted; the first is %s' % (self.name, len(self.wrong),
                                                                               self.wrong[0]['why']))
        if self.twice:
            said.append('%s: %d poses have a stamp that was there already' % (self.name, self.twice))
        return said

    def report(self):
        return {'views': self.views, 'samples': self.samples, 'minutes': self.minutes.report(),
                'growth': soak_rules.growth(self.samples), 'wrong': self.wrong[:100], 'wrong_poses': len(self.wrong),
                'worst_mtre_mm': self.worst[0], 'worst_inplane_mm': self.worst[1], 'poses': len(self.published),
                'frames': self.frames, 'starts_given': self.starts, 'reasons': self.reasons, 'exit_code': self.exit_code}

    def summary(self):
        frames = self.frames or dict.fromkeys(('received', 'accepted', 'refused', 'dropped'), 0)
        lines = ['%(received)d frames, %(accepted)d accepted, %(refused)d refused, %(dropped)d dropped' % frames]
        lines.append('%d poses, at most %.2f mm off, %.2f mm in the image, %d wrong; %d starts given' % (
            len(self.published), self.worst[0], self.worst[1], len(self.wrong), self.starts))
        lines += [soak_rules.in_words(name, one) for name, one in soak_rules.growth(self.samples).items()]
        return '\n  '.join(lines)
