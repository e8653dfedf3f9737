#!/usr/bin/python3
"""Camera and ROS master on one host, the node on another, and a link between them that is slow and breaks.

usage: two_hosts.py --tools FOLDER --scripts FOLDER --work FOLDER
The hosts are network namespaces of this machine, which go with the processes that hold them; the link is a pair of TUN
devices and a thread that carries their packets, with 100 ms of delay either way, and loses them while it is cut. Needs
root, or a system on which users may have namespaces of their own. Exit code 77: not possible here, and why.
"""
import argparse
import collections
import ctypes
import fcntl
import os
import select
import signal
import struct
import subprocess
import sys
import threading
import time
import traceback

CUTS_S = [1.0, 5.0, 30.0]
DELAY_S = 0.1
RATE = 15.0
# What was taken in a cut came after it, and later than stamps/max_late (1 s) allows; half a second for a node that had
# not seen a quick image before.
LATE_S = 1.5
CAMERA_IP, NODE_IP, PORT = '10.213.0.1', '10.213.0.2', 11311
NOT_POSSIBLE = 77
CLONE_NEWNET = 0x40000000
TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 1, 0x1000


def not_possible(why):
    print('skipped: ' + why)
    sys.exit(NOT_POSSIBLE)


def enter_user_namespace():
    """Where this user is root, as far as networks are concerned."""
    if os.geteuid() == 0:
        return
    unshare = ['unshare', '--user', '--map-root-user']
    if subprocess.run(unshare + ['true'], stderr=subprocess.DEVNULL).returncode != 0:
        not_possible('two hosts need root, or namespaces of users')
    os.execvp('unshare', unshare + [sys.executable] + sys.argv)


class Host:
    """A network namespace, held by a process that does nothing else."""

    def __init__(self, ip, peer):
        self.holder = subprocess.Popen(['unshare', '--net', 'sleep', 'infinity'], stderr=subprocess.PIPE)
        own = os.readlink('/proc/self/ns/net')
        while os.readlink('/proc/%d/ns/net' % self.holder.pid) == own:
            if self.holder.poll() is not None:
                not_possible('no network namespace can be made: ' + self.holder.stderr.read().decode().strip())
            time.sleep(0.01)
        self.enter()
        self.link = os.open('/dev/net/tun', os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(self.link, TUNSETIFF, struct.pack('16sH22x', b'link0', IFF_TUN | IFF_NO_PI))
        for words in ('link set lo up', 'addr add %s peer %s dev link0' % (ip, peer), 'link set link0 up'):
            subprocess.run(['ip'] + words.split(), check=True)

    def enter(self):
        """This thread, and what it starts, is on this host from now on."""
        with open('/proc/%d/ns/net' % self.holder.pid) as namespace:
            if ctypes.CDLL(None, use_errno=True).setns(namespace.fileno(), CLONE_NEWNET) != 0:
                raise OSError(ctypes.get_errno(), 'setns')

    def end(self):
        self.holder.kill()
        self.holder.wait()


class Link(threading.Thread):
    """Carries packets between two hosts."""

    def __init__(self, one, other):
        super().__init__(daemon=True)
        self.ends, self.cut, self.lost = (one.link, other.link), False, 0
        self.running = True

    def run(self):
        on_the_way = collections.deque()
        poll = select.poll()
        for end in self.ends:
            poll.register(end, select.POLLIN)
        while self.running:
            wait_s = on_the_way[0][0] - time.monotonic() if on_the_way else 0.05
            for end, _ in poll.poll(max(0, 1000 * wait_s)):
                packet = os.read(end, 65536)
                if self.cut:
                    self.lost += 1
                else:
                    on_the_way.append((time.monotonic() + DELAY_S, self.ends[end == self.ends[0]], packet))
            while on_the_way and on_the_way[0][0] <= time.monotonic():
                _, end, packet = on_the_way.popleft()
                try:
                    os.write(end, packet)
                except OSError:  # Its queue is full, as a router's may be.
                    self.lost += 1


def camera(bag):
    """On the camera's host: shows the session until it is ended."""
    import soak_camera
    shown = soak_camera.Camera(bag, RATE)
    shown.start()
    shown.thread.join()


class Observer:
    """On the node's host: what the node says, and when."""

    def __init__(self, first_view):
        import rospy
        from geometry_msgs.msg import PoseWithCovarianceStamped
        from xray_registration.msg import RegistrationStatus
        self.poses, self.reasons, self.latencies = [], collections.Counter(), []
        rospy.init_node('observer', disable_signals=True)
        rospy.Subscriber('/registration/pose', PoseWithCovarianceStamped, self.on_pose, queue_size=1000)
        rospy.Subscriber('/registration/status', RegistrationStatus, self.on_status, queue_size=1000)

    def on_pose(self, message):
        self.poses.append(message.header.stamp.to_sec())

    def on_status(self, message):
        if message.accepted:
            self.latencies.append(message.latency)
        else:
            self.reasons[message.reason.split(':')[0]] += 1

    def wait_for_pose(self, taken_after, seconds, node):
        """Of an image that was taken after this time. Returns when it came, or nothing."""
        end = time.time() + seconds
        while time.time() < end and node.poll() is None:
            if any(stamp > taken_after for stamp in self.poses[-100:]):
                return time.time()
            time.sleep(0.02)
        return None


def prepare(given):
    """Returns the CT, the session and a start near its first pose."""
    import rosbag
    ct, bag = os.path.join(given.work, 'ct.nii.gz'), os.path.join(given.work, 'session.bag')
    for line in (['make_phantom', '--phantom', 'head', '--spacing', '3', '--output', ct],
                 ['simulate_session', '--ct', ct, '--views', 'lateral:90', '--frames', str(round(6 * RATE)), '--rate',
                  str(RATE), '--size', '128', '--amplitude-mm', '4', '--amplitude-deg', '2', '--output', bag]):
        subprocess.run([os.path.join(given.tools, line[0])] + line[1:], check=True)
    with rosbag.Bag(bag) as session:
        pose = next(iter(session.read_messages(topics=['/lateral/ground_truth'])))[1].pose
    place = {'position': [pose.position.x, pose.position.y, pose.position.z],
             'orientation': [pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w]}
    return ct, bag, place


def check(given, hosts, link, started):
    ct, bag, start = prepare(given)
    os.environ['ROS_MASTER_URI'] = 'http://%s:%d' % (CAMERA_IP, PORT)
    os.environ.pop('ROS_HOSTNAME', None)
    log = open(os.path.join(given.work, 'processes.log'), 'w')

    def run(host, ip, *line):
        host.enter()
        started.append(subprocess.Popen(line, stdout=log, stderr=log, env=dict(os.environ, ROS_IP=ip)))
        return started[-1]

    run(hosts[0], CAMERA_IP, 'rosmaster', '--core', '-p', str(PORT))
    run(hosts[0], CAMERA_IP, sys.executable, os.path.abspath(__file__), '--camera', bag, '--scripts', given.scripts)
    hosts[1].enter()
    os.environ['ROS_IP'] = NODE_IP
    observer = Observer('lateral')
    import rospy
    rospy.set_param('/registration', {'ct': {'path': ct}, 'initial_pose': start})
    node = run(hosts[1], NODE_IP, os.path.join(given.tools, 'xray_registration_node'), '__name:=registration',
               'image_raw:=/lateral/image_raw')
    assert observer.wait_for_pose(0.0, 120, node), 'nothing is tracked at the start: %s' % observer.reasons
    failures = []
    for seconds in CUTS_S:
        cut = time.time()
        link.cut = True
        time.sleep(seconds)
        link.cut = False
        restored = time.time()
        # TCP tries again after as long as it has waited, twice as long each time.
        back = observer.wait_for_pose(restored, 2 * seconds + 20, node)
        if back is None:
            failures.append('no pose after a cut of %g s' % seconds)
            continue
        time.sleep(1.0)
        old = [stamp for stamp in observer.poses if cut < stamp < restored - LATE_S]
        print('cut for %g s: tracked again after %.1f s; %d poses of images that waited' % (seconds, back - restored, len(old)))
        if old:
            failures.append('%d poses are of images that waited in a cut of %g s' % (len(old), seconds))
    print('packets lost: %d; accepted %d, least latency %.3f s; refused: %s' % (
        link.lost, len(observer.poses), min(observer.latencies), dict(observer.reasons)))
    if min(observer.latencies) < DELAY_S:
        failures.append('the link has no delay: the least latency is %.3f s' % min(observer.latencies))
    if not observer.reasons['the image is late']:
        failures.append('no image was refused for being late: nothing waited in the cuts')
    if node.poll() is not None:
        failures.append('the node ended with %d' % node.returncode)
    else:
        node.send_signal(signal.SIGINT)
        if node.wait(timeout=60) != 0:  # It tells the master of each topic, one after the other.
            failures.append('the node ended with %d' % node.returncode)
    return failures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--tools')
    parser.add_argument('--scripts', required=True)
    parser.add_argument('--work')
    parser.add_argument('--camera', help=argparse.SUPPRESS)
    given = parser.parse_args()
    sys.path.insert(0, given.scripts)
    if given.camera:
        return camera(given.camera)
    enter_user_namespace()
    if not os.access('/dev/net/tun', os.R_OK | os.W_OK):
        not_possible('/dev/net/tun cannot be opened')
    os.makedirs(given.work, exist_ok=True)
    os.environ['ROS_LOG_DIR'] = os.path.join(given.work, 'ros_log')
    os.environ['POCL_CACHE_DIR'] = os.path.join(given.work, 'pocl')
    os.makedirs(os.environ['POCL_CACHE_DIR'], exist_ok=True)
    hosts, started, link, failures = [], [], None, ['the test itself failed']
    try:
        hosts.append(Host(CAMERA_IP, NODE_IP))
        hosts.append(Host(NODE_IP, CAMERA_IP))
        link = Link(*hosts)
        link.start()
        failures = check(given, hosts, link, started)
    except Exception:
        traceback.print_exc()
    finally:
        for process in reversed(started):
            if process.poll() is None:
                process.kill()
                process.wait()
        if link is not None:
            link.running = False
            link.join()
        for host in hosts:
            host.end()
    for failure in failures:
        print('FAILED: ' + failure)
    sys.stdout.flush()
    os._exit(1 if failures else 0)  # rospy would take leave of a master that is not there any more.


if __name__ == '__main__':
    main()
