"""The rows of docs/accuracy.md: which session, from how far, what it is told wrongly, and what is to be reached."""
import os

HEAD = ('ct/head_phantom_0.9mm.nii.gz', 'sessions/head_lateral.bag', '')
PELVIS_BOTH = ('ct/pelvis_2mm.nii.gz', 'sessions/pelvis_biplane.bag', 'ap,oblique')
PELVIS_AP = ('ct/pelvis_2mm.nii.gz', 'sessions/pelvis_biplane.bag', 'ap')
ROD = ('ct/pelvis_2mm.nii.gz', 'sessions/pelvis_ap_instrument.bag', '')
WRIST = ('wrist/radius.nii.gz', 'wrist/wrist_biplane.bag', 'cam01,cam02', '--target-size', '40', '--reference')
WRIST_BONES = ('wrist/radius.nii.gz', 'wrist/wrist_bones.bag', 'cam01,cam02', '--target-size', '40', '--reference')
WRIST_ALONE = WRIST[:2] + ('cam01',) + WRIST[3:]
# Another recording of the head, twice as fine, from two sides.
HEAD_BOTH = (HEAD[0], 'clinical_size/head_1024_biplane.bag', 'ap,oblique')
HEAD_AP = HEAD_BOTH[:2] + ('ap',)


class Row:
    """One line of a table: which session, the range of the starts (degrees, mm; None tracks it), what to reach, and the
    key in WRONG of what the registration is told wrongly. Pictures take their time where a cold start takes seconds."""
    bodies = None

    def __init__(self, name, session, start, goals, trials=100, wrong=None, drawn=True):
        self.name, self.start, self.goals, self.trials, self.wrong = name, start, goals, trials, wrong
        (self.ct, self.bag, self.views), self.extra = session[:3], list(session[3:])
        self.is_far = name.endswith('_beyond')  # Judged by its verdict alone, so neither in the main table nor drawn.
        self.is_drawn = drawn and start is not None and not self.is_far and not wrong
        self.title = os.path.splitext(os.path.basename(self.bag))[0]
        if self.views:
            self.title += ' (%s)' % self.views.replace(',', ' + ')
        self.start_text = 'tracked' if start is None else '%g°, %g mm' % start


class BodyRow(Row):
    """A row of bodies that move on their own: `bodies` is the key in BODIES, `body_start` their range against the CT's
    start. `good`: what a good result is within, beside 1 mm; `real`: real X-rays, whose truth has an error of its own."""

    def __init__(self, name, session, bodies, start, body_start=(0, 0), trials=100, goals=None, good=None, real=False):
        super().__init__(name, session, start, goals or {}, trials, drawn=False)
        self.bodies, self.body_start, self.good, self.real = bodies, body_start, good or {}, real
        if self.start and any(body_start):
            self.start_text += '; bodies %g°, %g mm' % body_start


class SearchRow(Row):
    """A row without a good start: `search` is the option of evaluate; wrong poses are never to be accepted."""

    def __init__(self, name, session, search, start, goals, trials=100, wrong=None):
        super().__init__(name, session, start, goals, trials, wrong, drawn=False)
        self.search, self.is_far, self.start = search, False, start or (0, 0)
        self.extra = self.extra + ['--' + search]
        self.start_text = {'localize': '~localize within %g°, %g mm', 'from-nothing': 'from nothing%.0s%.0s',
                           'lost': 'lost %g°, %g mm away'}[search] % self.start
        if wrong:
            self.start_text += ', ' + WRONG[wrong][1]


def goals(**limits):
    """Rates are to be reached, everything else is not to be exceeded."""
    return {key: ('>=' if key.endswith('_rate') else '<=', limit) for key, limit in limits.items()}


ROWS = [
    Row('head', HEAD, (6, 10), goals(success_rate=0.99, median_mtre=0.25, median_inplane=0.05)),
    Row('head_wide', HEAD, (15, 25), goals(success_rate=0.95, median_mtre=0.3, frame_ms=250)),
    Row('pelvis_both', PELVIS_BOTH, (6, 10), goals(success_rate=0.98, median_mtre=0.3)),
    Row('pelvis_ap', PELVIS_AP, (6, 10), goals(success_rate=0.95, median_mtre=1.0, median_inplane=0.04)),
    Row('pelvis_instrument', ROD, (6, 10), goals(success_rate=0.90, median_mtre=1.3, median_inplane=0.06)),
    Row('wrist', WRIST, (5, 5), goals(success_rate=0.90, median_mtre=0.4), trials=50),
    Row('wrist_bones', WRIST_BONES, (15, 15), goals(success_rate=0.90, median_mtre=0.4), trials=40, drawn=False),
    Row('head_tracked', HEAD, None, goals(accepted_rate=1.0, median_mtre=0.25)),
    Row('pelvis_both_tracked', PELVIS_BOTH, None, goals(accepted_rate=1.0, median_mtre=0.3)),
    Row('pelvis_ap_tracked', PELVIS_AP, None, goals(accepted_rate=1.0, median_mtre=1.0)),
    Row('pelvis_instrument_tracked', ROD, None, goals(accepted_rate=1.0, median_mtre=1.3)),
    # Far outside what a start from a search or a neighbour frame is: wrong results, for the verdict to be judged by.
    Row('head_beyond', HEAD, (60, 60), {}, trials=40),
    Row('pelvis_ap_beyond', PELVIS_AP, (60, 60), {}, trials=40),
    Row('pelvis_both_beyond', PELVIS_BOTH, (60, 60), {}, trials=20),
    Row('pelvis_instrument_beyond', ROD, (60, 60), {}, trials=20),
    Row('wrist_beyond', WRIST, (60, 30), {}, trials=20),
]

# What the registration is told wrongly: `evaluate --wrong`, and in words.
WRONG = {
    'focal': ('focal_length:1.02', 'focal length 2 % too long'),
    'focal_one': ('focal_length:1.02:oblique', 'focal length of the second view 2 % too long'),
    'centre': ('principal_point:12,0', 'principal point off by 12 px'),
    'radial': ('distortion:0.5', 'radial distortion, k1 = 0.5, not told'),
    's_shape': ('distortion:s_shape,3', 'S-shaped distortion, 3 px at the edge'),
    'view': ('view_pose:1deg,2mm', 'pose of the second view off by 1° and 2 mm'),
    'mirrored': ('mirrored_image:left_right', 'X-rays mirrored left-right'),
    'mirrored_one': ('mirrored_image:left_right:oblique', 'X-ray of the second view mirrored left-right'),
    'upside_down': ('mirrored_image:up_down', 'X-rays mirrored up-down'),
    'quarter': ('turned_image:90', 'X-rays turned by 90°'),
    'half': ('turned_image:180', 'X-rays turned by 180°'),
    'inverted': ('inverted_image', 'X-rays inverted'),
    'exchanged': ('exchanged_views', 'views exchanged'),
    'side': ('mirrored_ct', 'CT mirrored (wrong side)'),
    'size': ('ct_scale:1.03', 'CT 3 % too large'),
    'size_2': ('ct_scale:1.02', 'CT 2 % too large'),
    'patient': ('ct_scale:1.04,0.96,1.03', 'another patient (CT scaled 1.04, 0.96, 1.03)'),
    'sheared': ('sheared_ct:0.04', 'another patient (CT sheared by 0.04)'),
    'bent': ('bent_ct:4mm', 'another patient (CT bent by up to 4 mm)'),
    'pelvis': ('other_ct:{data}/' + PELVIS_AP[0], 'another CT (pelvis)'),
    'head': ('other_ct:{data}/' + HEAD[0], 'another CT (head)'),
}
# Session → keys of WRONG. The head from the front is nearly symmetric.
WRONG_OF = {
    'head': (HEAD, 'mirrored upside_down quarter half inverted focal centre radial s_shape side size size_2 patient sheared '
                   'bent pelvis'),
    'head_ap': (HEAD_AP, 'mirrored side'),
    'head_both': (HEAD_BOTH, 'mirrored mirrored_one exchanged view focal focal_one centre side size patient bent'),
    'pelvis_ap': (PELVIS_AP, 'mirrored half focal centre side patient bent'),
    'pelvis_both': (PELVIS_BOTH, 'mirrored exchanged view focal centre s_shape side size patient sheared bent head'),
    'wrist': (WRIST, 'mirrored exchanged view focal centre side patient bent'),
    'wrist_alone': (WRIST_ALONE, 'mirrored'),
}
WRONG_ROWS = [Row('%s_%s' % (name, wrong), session, (5, 5) if name.startswith('wrist') else (6, 10), {}, wrong=wrong)
              for name, (session, all_wrong) in WRONG_OF.items() for wrong in all_wrong.split()]

SPINE = ('spine/thorax_1.4mm.nii.gz', 'spine/spine_biplane.bag', 'ap,lateral')
SPINE_AP = SPINE[:2] + ('ap',)
OWN_WRIST_BONES = ('', 'wrist/wrist_bones.bag', 'cam01,cam02', '--target-size', '40')
KNEE = ('', 'knee_implants/knee.bag', '', '--target-size', '40')

# Configurations of bodies.
BODIES = {
    'vertebrae': '''ct: {{mask: {data}/spine/thorax_labels.nii.gz}}
bodies:
  - {{name: T12, label: 32, max_rotation: 0.1, max_translation: 0.008}}
  - {{name: T11, label: 33, max_rotation: 0.1, max_translation: 0.008}}
  - {{name: T10, label: 34, max_rotation: 0.1, max_translation: 0.008}}
''',
    'forearm': '''bodies:
  - {{name: radius, ct: {data}/wrist/radius.nii.gz, max_rotation: 0.3, max_translation: 0.01}}
  - {{name: ulna, ct: {data}/wrist/ulna.nii.gz, max_rotation: 0.3, max_translation: 0.01}}
''',
    'implants': '''image: {{find_metal: false}}
bodies:
  - {{name: femur, mesh: {data}/knee_implants/femur.stl, max_rotation: 0.2, max_translation: 0.01}}
  - {{name: tibia, mesh: {data}/knee_implants/tibia.stl, max_rotation: 0.2, max_translation: 0.01}}
''',
}


def limits(**given):
    """Of what moving_bodies.py measures: shares of what is good, accepted or agrees are to be reached, all else is not to
    be exceeded."""
    return {key: ('>=' if key in ('good', 'accepted', 'agree') else '<=', limit) for key, limit in given.items()}


BODY_ROWS = [
    BodyRow('spine', SPINE, 'vertebrae', (3, 5), (2, 2), goals=limits(good=0.95, mtre=0.3, inplane=0.1)),
    BodyRow('spine_ap', SPINE_AP, 'vertebrae', (3, 5), (2, 2), goals=limits(inplane=0.2)),
    # One vertebra up or down is 25 to 35 mm; nothing wrong may be accepted.
    BodyRow('spine_level', SPINE, 'vertebrae', (3, 5), (2, 30), goals=limits(false=0)),
    # The whole CT so far off; what it is found at, the bodies follow.
    BodyRow('spine_shifted', SPINE, 'vertebrae', (3, 35), (2, 2), goals=limits(false=0)),
    BodyRow('spine_tracked', SPINE, 'vertebrae', None, goals=limits(accepted=1.0, mtre=0.3, inplane=0.1)),
    BodyRow('wrist_own', OWN_WRIST_BONES, 'forearm', (5, 5), trials=40, goals=limits(agree=0.9), real=True),
    BodyRow('knee', KNEE, 'implants', (5, 5), trials=30, goals=limits(good=0.9), good={'final_rotation_deg': 1.5},
            real=True),
]

CLINICAL = (HEAD[0], 'clinical_size/head_1024_biplane.bag', 'ap,oblique')
SPINE_ONE = SPINE[:2] + ('ap',)
SEARCH_ROWS = [
    SearchRow('head_localize', HEAD, 'localize', (60, 100), goals(accepted_rate=0.95, frame_ms=2000)),
    SearchRow('pelvis_both_localize', PELVIS_BOTH, 'localize', (60, 100), goals(accepted_rate=0.95, frame_ms=3000)),
    SearchRow('pelvis_ap_localize', PELVIS_AP, 'localize', (45, 60), goals(accepted_rate=0.90, frame_ms=3000)),
    SearchRow('spine_localize', SPINE, 'localize', (60, 100), {}, trials=24),
    SearchRow('wrist_localize', WRIST, 'localize', (45, 30), goals(success_rate=0.80, frame_ms=6000), trials=40),
    SearchRow('head_nothing', HEAD, 'from-nothing', None, goals(accepted_rate=0.90, frame_ms=6000), trials=40),
    SearchRow('pelvis_ap_nothing', PELVIS_AP, 'from-nothing', None, goals(accepted_rate=0.90, frame_ms=6000), trials=30),
    SearchRow('pelvis_both_nothing', PELVIS_BOTH, 'from-nothing', None, {}, trials=30),
    SearchRow('clinical_nothing', CLINICAL, 'from-nothing', None, {}, trials=10),
    SearchRow('spine_ap_nothing', SPINE_ONE, 'from-nothing', None, {}, trials=12),
    SearchRow('head_lost', HEAD, 'lost', (8, 20), goals(accepted_rate=0.95), trials=50),
    SearchRow('pelvis_both_lost', PELVIS_BOTH, 'lost', (8, 20), goals(accepted_rate=0.95), trials=50),
    SearchRow('pelvis_ap_lost', PELVIS_AP, 'lost', (8, 20), goals(accepted_rate=0.95), trials=50),
    # Nothing may be accepted.
    SearchRow('head_nothing_mirrored', HEAD, 'from-nothing', None, {}, trials=40, wrong='mirrored'),
    SearchRow('head_nothing_upside', HEAD, 'from-nothing', None, {}, trials=20, wrong='upside_down'),
    SearchRow('pelvis_nothing_mirrored', PELVIS_AP, 'from-nothing', None, {}, trials=15, wrong='mirrored'),
    SearchRow('spine_nothing_mirrored', SPINE_ONE, 'from-nothing', None, {}, trials=12, wrong='mirrored'),
    SearchRow('head_nothing_pelvis', HEAD, 'from-nothing', None, {}, trials=20, wrong='pelvis'),
    SearchRow('pelvis_nothing_head', PELVIS_AP, 'from-nothing', None, {}, trials=15, wrong='head'),
]
