"""Every color of the page with the one thing that it means, in the dark theme and in the light one.

The dark ones follow Sobreira et al. 2016, Fig. 12, as far as a dark floor allows: reflectors blue, gates light blue,
inliers yellow; of the two that the paper has in red, the pose is rose and a rejected detection red. The light ones keep
the hue and are as dark as a white floor asks for. Nothing is painted in here: `theme` hands the dark ones to whoever
draws, and `relight` puts the light ones in their place on the way to a browser that asks for them.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

Color: TypeAlias = tuple[int, int, int]


class Paint(NamedTuple):
    """One color of the page."""

    meaning: str
    """The one thing it stands for."""
    dark: Color
    """In the dark theme."""
    light: Color
    """In the light one."""


class Floor:
    """What the floor is made of, and what lies on it without a run."""

    BACKGROUND = Paint("around the floor", (16, 18, 21), (240, 242, 246))
    UNKNOWN = Paint("floor that the map does not know", (24, 26, 30), (246, 247, 250))
    FREE = Paint("free floor", (37, 40, 45), (255, 255, 255))
    WALL = Paint("wall", (112, 118, 128), (128, 135, 147))
    WALL_3D = Paint("wall that stands up", (118, 124, 134), (132, 139, 151))
    RIM = Paint("rim of what is drawn over a heatmap", (0, 0, 0), (30, 33, 38))
    GRID_METER = Paint("grid of a meter", (62, 66, 73), (214, 218, 224))
    ROUTE = Paint("route", (116, 128, 150), (92, 104, 128))
    STATION = Paint("station", (92, 214, 220), (0, 124, 130))
    REFLECTOR = Paint("reflector", (48, 108, 255), (18, 66, 200))
    ZONE = Paint("zone in which some kinds correct the pose", (170, 196, 84), (96, 118, 16))
    TAG = Paint("tag that tells place and heading", (126, 206, 255), (8, 104, 160))
    SELECTED = Paint("selected", (255, 159, 28), (198, 110, 0))
    DRAFT_PAPER = Paint("paper of an image being placed", (58, 62, 70), (222, 226, 232))
    DRAFT_INK = Paint("ink of an image being placed", (214, 219, 227), (52, 57, 65))
    PREVIEW = Paint("what is being drawn or measured", (232, 226, 206), (66, 60, 40))
    VEHICLE = Paint("vehicle", (236, 239, 244), (28, 31, 36))
    TRUCK = Paint("body of the vehicle in 3D", (232, 150, 40), (198, 120, 24))


class Run:
    """What a drive shows on the floor and in plots."""

    GATE = Paint("validation area (gate)", (96, 176, 255), (28, 106, 184))
    POSE = Paint("pose and its 2 sigma", (255, 92, 138), (214, 36, 104))
    HEADING = Paint("2 sigma of the heading", (178, 255, 218), (36, 100, 72))
    INLIER = Paint("inlier", (255, 214, 10), (138, 112, 0))
    OFFSET = Paint("offset of an inlier", (150, 132, 52), (146, 128, 52))
    OUTLIER = Paint("detection rejected by the gate", (255, 76, 66), (222, 8, 12))
    OUTLIER_DETECTOR = Paint("detection of too few or many beams", (196, 74, 60), (150, 46, 36))
    SCAN = Paint("scan point", (190, 197, 206), (52, 74, 104))
    MATCHED = Paint("beam on a wall of the map", (134, 232, 172), (6, 120, 70))
    UNMATCHED = Paint("beam that no wall explains", (236, 130, 120), (176, 50, 60))
    FURTHER_SCAN = Paint("scan point of a further scanner", (206, 172, 140), (132, 100, 68))
    FIELD = Paint("field of view", (150, 160, 120), (124, 134, 94))
    FAR_FIELD = Paint("reach of the scan", (111, 118, 92), (134, 142, 116))
    TRAIL = Paint("trail of the estimate", (64, 200, 150), (0, 134, 94))
    REFERENCE = Paint("reference, and the error to it", (196, 140, 255), (134, 76, 190))
    CAMERA_BY_LASER = Paint("camera by the laser", (122, 168, 250), (26, 92, 196))
    CAMERA_BY_CONTOUR = Paint("camera by its contour", (255, 182, 96), (184, 98, 0))
    HYPOTHESIS = Paint("a place where the vehicle may be", (255, 190, 240), (168, 0, 150))
    GOODS = Paint("temporary landmark", (214, 196, 120), (122, 104, 8))
    GOODS_SIGMA = Paint("2 sigma of a temporary landmark", (150, 224, 190), (10, 118, 92))
    CLOUD = Paint("earlier innovations", (128, 150, 176), (104, 126, 154))
    SPREAD = Paint("mean and spread of innovations", (195, 204, 216), (78, 88, 102))
    AFTER = Paint("after the correction", (232, 234, 238), (36, 40, 46))
    NOT_KNOWN = Paint("nothing was seen, nothing is known", (120, 124, 132), (128, 130, 136))
    VARIANT_A = Paint("variant A", (255, 160, 190), (172, 80, 114))
    VARIANT_B = Paint("variant B", (168, 230, 92), (74, 120, 0))
    VARIANT_C = Paint("variant C", (250, 170, 120), (168, 92, 44))
    FIRST_CURVE = Paint("first curve of a plot", (77, 196, 255), (0, 116, 164))
    SECOND_CURVE = Paint("second curve of a plot", (255, 180, 84), (160, 96, 0))
    THIRD_CURVE = Paint("third curve of a plot", (226, 120, 240), (160, 44, 176))
    WHOLE_CURVE = Paint("curve of the whole", (230, 233, 239), (40, 44, 51))
    EDIT = Paint("an edit during the drive", (192, 139, 255), (128, 70, 184))
    OPERATIONAL = Paint("operational", (28, 127, 62), (24, 122, 56))
    FAIL = Paint("the localization fails", (213, 40, 37), (192, 28, 26))
    IDLE = Paint("no run", (74, 79, 87), (104, 110, 119))
    FAIL_EVENT = Paint("an event that fails or is lost", (255, 82, 82), (200, 34, 40))
    RECOVERED_EVENT = Paint("an event that recovers", (64, 200, 152), (0, 128, 90))


class Plan:
    """What studies of the plan show."""

    OVER_LIMIT = Paint("a limit, and what is beyond it", (246, 94, 24), (196, 54, 4))
    TOO_LITTLE = Paint("too few reflectors", (240, 132, 52), (188, 92, 0))
    RISK = Paint("risk of a wrong association", (255, 140, 40), (206, 104, 6))
    RECOVERY = Paint("goes on by itself", (120, 230, 110), (30, 140, 22))
    SUGGESTED = Paint("suggested reflector", (92, 240, 214), (0, 146, 126))
    TAKEN_DOWN = Paint("reflector that would be taken down", (255, 138, 101), (204, 92, 56))
    KEEP_OUT = Paint("no new reflectors here", (222, 150, 70), (176, 108, 24))
    DEPENDENT = Paint("depends on the failed reflector", (255, 92, 205), (208, 40, 160))
    FIRST_TWIN = Paint("first of two places taken for each other", (120, 220, 255), (30, 146, 180))
    SECOND_TWIN = Paint("second of two places taken for each other", (255, 120, 220), (206, 72, 174))
    UNIQUE = Paint("cold start is unique", (39, 74, 92), (192, 230, 250))
    TOO_FEW = Paint("too few for a cold start", (120, 104, 150), (190, 174, 224))
    SOME = Paint("some cold starts go wrong", (224, 168, 60), (232, 176, 70))
    EVERY = Paint("every cold start goes wrong", (214, 70, 110), (240, 96, 132))
    NO_FIX = Paint("no fix", (228, 92, 60), (236, 104, 72))
    NO_FIX_HATCH = Paint("hatch of no fix", (58, 22, 22), (252, 218, 208))
    KEPT = Paint("reflector of the kept layout", (166, 190, 255), (96, 116, 180))
    WORSE_1 = Paint("little worse", (140, 92, 52), (248, 194, 150))
    WORSE_2 = Paint("worse", (204, 112, 42), (232, 137, 70))
    WORSE_3 = Paint("much worse", (255, 148, 40), (166, 86, 0))
    BETTER_1 = Paint("little better", (46, 92, 124), (160, 210, 246))
    BETTER_2 = Paint("better", (44, 132, 186), (84, 168, 225))
    BETTER_3 = Paint("much better", (92, 190, 250), (0, 112, 168))
    NO_DIFFERENCE = Paint("as before", (66, 70, 78), (226, 230, 238))
    NO_FIX_NEITHER = Paint("no fix in either layout", (104, 108, 116), (180, 184, 192))
    NO_FIX_DARK = Paint("hatch of no fix in either layout", (30, 30, 34), (246, 246, 248))
    FROM_NOISE = Paint("error from noise", (138, 148, 164), (134, 144, 160))
    FROM_MAP = Paint("error from the map", (74, 134, 255), (62, 120, 240))
    FROM_MOUNTING = Paint("error from the mounting", (222, 110, 206), (196, 84, 180))
    FROM_RANGE = Paint("error from ranges", (255, 190, 70), (182, 126, 0))
    FROM_CLOCK = Paint("error from the clock", (60, 200, 180), (8, 160, 144))


class Worded:
    """Words and marks of the panels that say how something is."""

    BRAND = Paint("what can be pressed", (58, 118, 197), (40, 98, 178))
    PRESS = Paint("what is to be done next", (47, 95, 159), (36, 88, 156))
    DONE = Paint("done", (76, 206, 146), (0, 126, 84))
    LACKING = Paint("is missing", (255, 170, 60), (164, 90, 0))
    NOTE = Paint("what is to be known", (255, 220, 90), (128, 100, 0))
    REFUSED = Paint("refused, or wrong", (255, 122, 110), (184, 50, 44))
    DOUBTFUL = Paint("doubtful", (255, 183, 77), (154, 98, 0))
    BETTER = Paint("a better number", (88, 214, 141), (0, 122, 66))
    WORSE = Paint("a worse number", (255, 134, 120), (190, 58, 50))
    DIFFERENT = Paint("another number", (255, 211, 77), (132, 104, 0))
    SETTING = Paint("a setting", (185, 192, 202), (88, 96, 108))
    WORD = Paint("words on a picture", (213, 218, 226), (50, 55, 63))
    STATUS = Paint("words on the floor", (196, 202, 211), (62, 68, 77))
    INK = Paint("words on a plot", (231, 233, 238), (34, 38, 44))
    ON_LACKING = Paint("words on what is missing", (22, 24, 27), (254, 254, 254))


class Surface:
    """What panels and lists are made of."""

    LINE = Paint("line of a list", (38, 41, 46), (233, 236, 241))
    SELECTED_LINE = Paint("selected line of a list", (124, 76, 10), (255, 222, 168))
    CHOSEN_LINE = Paint("chosen line of a list", (34, 66, 108), (198, 220, 248))
    WARNING_LINE = Paint("warning in a list", (98, 70, 18), (255, 236, 190))
    ERROR_LINE = Paint("error in a list", (112, 34, 32), (255, 212, 206))
    HEAD = Paint("head of a table", (36, 36, 36), (253, 253, 253))
    RULE = Paint("rule of a table", (47, 50, 55), (224, 227, 232))
    PRESSED = Paint("pressed, or under the pointer", (44, 48, 54), (218, 226, 238))
    EDGE = Paint("edge of a panel", (58, 58, 58), (200, 203, 208))
    EDGE_HOVER = Paint("edge under the pointer", (85, 85, 85), (150, 156, 166))
    EDGE_QUIET = Paint("quiet edge", (68, 72, 79), (190, 195, 203))
    CARD = Paint("card", (36, 39, 44), (252, 252, 254))
    CARD_EDGE = Paint("edge of a card", (75, 80, 88), (176, 182, 191))
    BADGE = Paint("number of a task", (56, 60, 68), (226, 229, 234))
    DISABLED = Paint("cannot be pressed", (57, 62, 69), (228, 230, 234))
    ON_DISABLED = Paint("words on what cannot be pressed", (170, 176, 185), (106, 112, 121))
    SHARE = Paint("ground of a bar", (76, 81, 89), (205, 209, 215))
    SHARE_BAR = Paint("bar", (188, 195, 204), (90, 97, 107))
    TIME_LINE = Paint("what lies ahead of the time line", (51, 54, 60), (212, 216, 222))
    AXIS = Paint("numbers of an axis", (154, 160, 168), (92, 98, 107))
    AXIS_GRID = Paint("grid of a plot", (48, 51, 56), (228, 231, 235))
    AXIS_TICK = Paint("tick of an axis", (58, 61, 67), (190, 195, 202))
    PLOT = Paint("ground of a plot in a file", (27, 29, 33), (251, 252, 253))
    FINE = Paint("fine grid of a picture", (34, 37, 43), (236, 238, 242))
    COARSE = Paint("coarse grid of a picture", (53, 58, 67), (208, 213, 221))
    RAY = Paint("ray of the scanner", (107, 116, 130), (122, 130, 144))


def _all() -> dict[str, Paint]:
    """Every paint by its name."""
    named: dict[str, Paint] = {}
    for group in (Floor, Run, Plan, Worded, Surface):
        named |= {f"{group.__name__}.{name}": paint for name, paint in vars(group).items() if isinstance(paint, Paint)}
    return named


PAINTS = _all()
"""Every color of the page by its name."""
