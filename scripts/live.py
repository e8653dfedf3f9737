"""What the scripts that measure a live node share: a ROS master of their own, the node, and a recorded session's frames."""
import os
import socket
import subprocess
import sys
import tempfile
import time

import documents


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


class Master:
    """A master on a free port, which this process and its children then use. Messages of the build can be imported."""

    def __enter__(self):
        port = free_port()
        os.environ.update(ROS_MASTER_URI='http://127.0.0.1:%d' % port, ROS_IP='127.0.0.1',
                          ROS_LOG_DIR=tempfile.mkdtemp())
        sys.path.insert(0, os.path.join(documents.ROOT, 'build/devel/lib/python3/dist-packages'))
        self.process = subprocess.Popen(['rosmaster', '--core', '-p', str(port)], stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        if not self._answers(port):
            self.__exit__()
            sys.exit('rosmaster does not answer')

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()

    @staticmethod
    def _answers(port):
        for _ in range(300):
            with socket.socket() as probe:
                if probe.connect_ex(('127.0.0.1', port)) == 0:
                    return True
            time.sleep(0.1)
        return False


class Node:
    """The node as /registration, with the parameters that are there already."""

    def __init__(self, tools):
        self.line = [os.path.join(tools, 'xray_registration_node'), '__name:=registration']

    def __enter__(self):
        self.process = subprocess.Popen(self.line, stdout=subprocess.DEVNULL)

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()


def parameter(pose):
    """A geometry_msgs/Pose as the parameter initial_pose."""
    return {'position': [getattr(pose.position, k) for k in 'xyz'],
            'orientation': [getattr(pose.orientation, k) for k in 'xyzw']}


def recorded(bag, view):
    """The session's frames, forwards and backwards so that the motion never jumps, and where the CT is in the first."""
    import rosbag
    frames, pose = {}, None
    with rosbag.Bag(bag) as file:
        for topic, message, _ in file.read_messages():
            stamp = getattr(getattr(message, 'header', None), 'stamp', None)
            if topic == '/%s/image_raw' % view:
                frames.setdefault(stamp, {})['image'] = message
            elif topic == '/%s/camera_info' % view:
                frames.setdefault(stamp, {})['info'] = message
            elif topic.startswith('/%s/ground_truth' % view) and pose is None:
                pose = message.pose
    order = [frames[stamp] for stamp in sorted(frames)]
    return order + order[-2:0:-1], pose
