"""The C-arm of scripts/soak: a session that is shown again and again, with its true poses, as it is or spoilt."""
import collections
import copy
import itertools
import threading
import time

import numpy
import rosbag
import rospy
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage

FIRST = 'lateral'


def matrix(pose):
    """Millimetres."""
    x, y, z, w = (getattr(pose.orientation, name) for name in 'xyzw')
    made = numpy.eye(4)
    made[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    made[:3, 3] = [1e3 * pose.position.x, 1e3 * pose.position.y, 1e3 * pose.position.z]
    return made


class Session:
    """Frames as {view: (image, info)}, the CT's true poses in the first view's camera, and the other views' transforms."""

    def __init__(self, path):
        by_stamp = {}
        self.views_tf = None
        with rosbag.Bag(path) as bag:
            for topic, message, _ in bag.read_messages():
                # rosbag's own classes are not the ones that rospy publishes.
                if topic == '/tf_static':
                    self.views_tf = as_type(message, TFMessage)
                    continue
                view, kind = topic.strip('/').split('/', 1)
                entry = by_stamp.setdefault(message.header.stamp.to_nsec(), {})
                if kind == 'image_raw':
                    entry.setdefault(view, {})['image'] = as_type(message, Image)
                elif kind == 'camera_info':
                    entry.setdefault(view, {})['info'] = as_type(message, CameraInfo)
                elif topic == '/%s/ground_truth' % FIRST:
                    entry['truth'] = message.pose
        frames = [by_stamp[stamp] for stamp in sorted(by_stamp) if 'truth' in by_stamp[stamp]]
        self.truths = [frame.pop('truth') for frame in frames]
        self.T_camera_ct = [matrix(pose) for pose in self.truths]
        self.frames = [{view: (one['image'], one['info']) for view, one in frame.items()} for frame in frames]
        self.views = sorted(self.frames[0], key=lambda view: view != FIRST)
        self.frame_id = self.frames[0][FIRST][0].header.frame_id


def as_type(message, kind):
    made = kind()
    for name in kind.__slots__:
        setattr(made, name, getattr(message, name))
    return made


# What cannot be used: each changes copies of the image and the camera_info of a view.
def truncated(image, info):
    image.data = image.data[:len(image.data) // 2]


def unknown_encoding(image, info):
    image.encoding = 'nonsense'


def empty(image, info):
    image.width = image.height = image.step = 0
    image.data = b''


def huge(image, info):
    image.width = image.height = 2 ** 31


def short_rows(image, info):
    image.step = 1


def black(image, info):
    image.data = bytes(len(image.data))


def noise(image, info):
    image.data = numpy.random.default_rng(image.header.stamp.to_nsec()).bytes(len(image.data))


def no_focal_length(image, info):
    info.K = [0.0] * 9


def infinite_focal_length(image, info):
    info.K = [float('nan')] * 9


def other_size(image, info):
    info.width, info.height = info.width + 1, info.height * 2


def other_frame(image, info):
    image.header.frame_id = info.header.frame_id = 'elsewhere'


def no_frame(image, info):
    image.header.frame_id = info.header.frame_id = ''


BROKEN = [truncated, unknown_encoding, empty, huge, short_rows, black, noise, no_focal_length, infinite_focal_length,
          other_size, other_frame, no_frame]


class Camera:
    """Publishes a frame at a rate, in a thread of its own. What it shows is set by attributes, between two frames:
    `on`, `views` (those that are sent), `with_info`, `clock_ahead_s` (its clock against the true one), `spoil` (a
    function of the frame's number that gives one of BROKEN, or None), `hold` (the same image again and again). By how
    many seconds the stamps of the next frames lie stands in `lies`, one for each, None for one that does not lie at
    all and 0 for one without a stamp."""

    def __init__(self, bag, rate):
        rospy.init_node('soak', disable_signals=True)
        self.session, self.rate = Session(bag), rate
        self.shown = {}  # By stamp, ns: the true pose, or None for what must not be accepted; seconds that it is ahead.
        self.usual()
        self.offset, self.number, self.index = 0, 0, 0
        self.running = False
        self.images = {v: rospy.Publisher('/%s/image_raw' % v, Image, queue_size=2) for v in self.session.views}
        self.infos = {v: rospy.Publisher('/%s/camera_info' % v, CameraInfo, queue_size=2) for v in self.session.views}
        self.tf = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        self.tf.publish(self.session.views_tf)
        self.thread = threading.Thread(target=self.run, daemon=True)

    def usual(self):
        self.on, self.views, self.with_info, self.hold = True, list(self.session.views), True, False
        self.clock_ahead_s, self.spoil, self.lies = 0.0, None, collections.deque()

    def start(self):
        self.running = True
        self.thread.start()

    def stop(self):
        self.running = False
        self.thread.join()

    def jump(self):
        """The patient is elsewhere all at once."""
        self.offset += len(self.session.frames) // 2

    def truth_now(self):
        return self.session.truths[self.index]

    def run(self):
        begin = time.monotonic()
        for tick in itertools.count():
            time.sleep(max(0.0, begin + tick / self.rate - time.monotonic()))
            if not self.running:
                return
            # What is shown may be changed at any time: it is looked at once for a frame.
            if not self.hold:
                self.index = (tick + self.offset) % len(self.session.frames)
            if self.on:
                self.publish()

    def publish(self):
        spoil, views, with_info = self.spoil, self.views, self.with_info
        lie = self.lies.popleft() if self.lies else None
        self.number += 1
        stamp = rospy.Time(nsecs=0 if lie == 0 else time.time_ns() + round(1e9 * (self.clock_ahead_s + (lie or 0.0))))
        if lie != 0 and stamp.to_nsec() in self.shown:  # A clock that was set back meets its own stamps now and then.
            stamp += rospy.Duration(nsecs=1)
        change = spoil(self.number) if spoil else None
        # A held image shows what is, as far as anybody can see who missed the one before it.
        usable = with_info and change is None and lie is None
        self.shown[stamp.to_nsec()] = (self.session.T_camera_ct[self.index] if usable else None, self.clock_ahead_s)
        for view in views:
            image, info = self.session.frames[self.index][view]
            if change:
                image, info = copy.deepcopy(image), copy.deepcopy(info)
            image.header.stamp = info.header.stamp = stamp
            if change:
                change(image, info)
            if with_info:
                self.infos[view].publish(info)
            self.images[view].publish(image)
