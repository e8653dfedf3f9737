"""What happens in a long day, for scripts/soak: one event after the other, in a seeded order, each as often."""
import random
import threading
import time

import rospy
from sensor_msgs.msg import Image

import soak_camera


class Events:
    """Runs in a thread of its own. `deliberate`: a node without a pose is meant to be so just now."""

    def __init__(self, camera, nodes, every_s, seed):
        self.camera, self.nodes, self.every_s = camera, nodes, every_s
        self.random, self.counts, self.failed, self.deliberate = random.Random(seed), {}, [], False
        self.stopping = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.kinds = [self.forget, self.load, self.load_what_is_no_ct, self.patient_jumps, self.short_gap, self.long_gap,
                      self.broken_images, self.lying_stamps, self.held_image, self.no_camera_info, self.a_view_is_missing,
                      self.camera_clock_is_set, self.start_is_far_off, self.switched_off, self.somebody_looks]

    def start(self):
        self.thread.start()

    def stop(self):
        self.stopping.set()
        self.thread.join()

    def wait(self, seconds):
        self.stopping.wait(seconds)

    def run(self):
        try:
            for node in self.nodes:
                node.give_start()
            while not self.stopping.is_set():
                for kind in self.random.sample(self.kinds, len(self.kinds)):
                    self.wait(self.every_s)
                    if self.stopping.is_set():
                        return
                    kind(self.random.choice(self.nodes))
                    self.deliberate = False
                    self.camera.usual()
                    self.counts[kind.__name__] = self.counts.get(kind.__name__, 0) + 1
        except Exception as error:  # A node that does not answer is what this looks for.
            self.failed.append('an event failed: %s: %s' % (type(error).__name__, error))

    def forget(self, node):
        node.reset()
        self.wait(0.5)
        node.give_start()

    def load(self, node):
        answer = node.load_other()
        if not answer.success:
            self.failed.append('%s: a CT was not loaded: %s' % (node.name, answer.message))
        node.give_start()

    def load_what_is_no_ct(self, node):
        for path in ('/nowhere/ct.nii.gz', '/proc/self/cmdline', node.log_path):
            if node.load_path(path).success:
                self.failed.append('%s: %s was loaded as a CT' % (node.name, path))

    def patient_jumps(self, node):
        self.camera.jump()

    def short_gap(self, node):
        self.camera.on = False
        self.wait(1.0)

    def long_gap(self, node):
        self.camera.on = False
        self.wait(6.0)  # Longer than health/pose_age_error: LOST.

    def broken_images(self, node):
        self.camera.spoil = lambda number: soak_camera.BROKEN[number % len(soak_camera.BROKEN)] if number % 3 else None
        self.wait(3.0)

    def lying_stamps(self, node):
        for lie in (0, 3600.0, -5.0, 2.0, -3600.0):
            self.camera.lies.extend([lie] + [None] * 5)  # Three in a row would be believed.
        while self.camera.lies and not self.stopping.is_set():
            self.wait(0.1)

    def held_image(self, node):
        self.camera.hold = True
        self.wait(1.0)
        self.camera.hold = False

    def no_camera_info(self, node):
        self.camera.with_info = False
        self.wait(2.0)

    def a_view_is_missing(self, node):
        self.camera.views = self.camera.session.views[:1]
        self.wait(2.0)

    def camera_clock_is_set(self, node):
        for seconds in (-3.0, 0.0, -0.03, 0.0):
            self.camera.clock_ahead_s = seconds
            self.wait(1.5)

    def start_is_far_off(self, node):
        self.deliberate = True
        node.give_start(off_mm=35.0)
        self.wait(2.0)
        node.give_start()

    def switched_off(self, node):
        node.enable(False)
        self.wait(1.0)
        node.enable(True)

    def somebody_looks(self, node):
        prefix = '/%s/' % node.name if len(node.views) == 1 else '/%s/%s/' % (node.name, node.views[0])
        looks = [rospy.Subscriber(prefix + name, Image, lambda image: None) for name in ('drr', 'overlay')]
        self.wait(2.0)
        for look in looks:
            look.unregister()
