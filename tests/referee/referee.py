#!/usr/bin/env python3
"""Compares moving objects of phantom3 with MuJoCo, an independent simulator.

    python3 -m venv venv && venv/bin/pip install mujoco
    venv/bin/python tests/referee/referee.py target/release/phantom3

Each case is the same experiment in both: a scene and a hand file for phantom3, a model for MuJoCo. What is compared
are quantities that do not depend on how a simulator makes contacts soft: times, distances, angles, accelerations. Each
has the difference that is allowed and where it comes from. Prints a table; status 0: all agree, 1: some do not,
77: MuJoCo is not installed.
"""

import csv
import math
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import mujoco
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}; `pip install mujoco` gets it")
    sys.exit(77)

G = 9.81
EDGE = 0.05
MASS = 0.1
FINGER = 0.0005  # radius of MuJoCo's fingers; ours are points
SUNK = MASS * G / (4 * 2000 * 1000 / 3000)  # on four springs of 2000 and 1000 N/m in series


class Case:
    """What both simulators did in one experiment, quantity by quantity."""

    def __init__(self, name):
        self.name, self.rows = name, []

    def compare(self, what, unit, ours, theirs, allowed, why):
        self.rows.append((what, unit, ours, theirs, allowed, why))


def run_ours(phantom3, scene, hand):
    """Columns of phantom3's recording, as arrays."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "scene.toml").write_text(scene)
        (folder / "hand.csv").write_text(hand)
        command = [phantom3, "run", "scene.toml", "--hand", "hand.csv", "--clock", "virtual", "--headless", "--record", "out.csv"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"phantom3 failed: {done.stderr}")
        with open(folder / "out.csv") as file:
            rows = list(csv.reader(file))
    header = rows[0]
    wanted = [i for i, name in enumerate(header) if not name.endswith(("_entity", "_feature", "_friction"))]
    table = np.array([[float(row[i]) for i in wanted] for row in rows[1:]])
    return {header[i]: table[:, place] for place, i in enumerate(wanted)}


def run_theirs(bodies, seconds, mu, floor_normal=(0, 1, 0), hips=None, v0=None, extra=""):
    """Poses of the first body in each millisecond: (n, 3) positions and (n, 4) quaternions."""
    n = " ".join(f"{x:.17g}" for x in floor_normal)
    # Heavy enough that nothing diverts them, on rails; a body that is just put elsewhere would have no velocity, and
    # friction would not drag along what it touches.
    rails = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
    fingers = "".join(
        f'<body gravcomp="1">{rails}<geom type="sphere" size="{FINGER}" mass="1e4" friction="{mu} 0 0"/></body>'
        for _ in (hips(0) if hips else ())
    )
    # Contacts hard enough to sink in by some micrometres; softer ones and harder ones slide too easily.
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="0.0002" gravity="0 -{G} 0" cone="elliptic" impratio="10"/>
      <default><geom condim="3" friction="{mu} 0 0" solref="0.004 1"/></default>
      <worldbody>
        <geom type="plane" size="0 0 1" zaxis="{n}"/>
        {bodies}{fingers}
      </worldbody>
      {extra}
    </mujoco>""")
    data = mujoco.MjData(model)
    if v0 is not None:
        data.qvel[: len(v0)] = v0
    positions, turns = [], []
    step = model.opt.timestep
    for tick in range(round(seconds * 1000) + 1):
        for part in range(5):
            t = tick * 1e-3 + part * step
            if hips:
                now, then = (np.array(hips(t + later)).ravel() for later in (0, step))
                data.qpos[7:], data.qvel[6:] = now, (then - now) / step
            if part == 0:
                mujoco.mj_forward(model, data)
                positions.append(data.qpos[:3].copy())
                turns.append(data.qpos[3:7].copy())
            mujoco.mj_step(model, data)
    return np.array(positions), np.array(turns)


def box(size, mass, pos, quat=(1, 0, 0, 0)):
    half = " ".join(f"{s / 2:.17g}" for s in size)
    at, turn = (" ".join(f"{x:.17g}" for x in v) for v in (pos, quat))
    return f'<body pos="{at}" quat="{turn}"><freejoint/><geom type="box" size="{half}" mass="{mass}"/></body>'


def scene(shape, mass, pos, mu, quat=(1, 0, 0, 0), normal=(0, 1, 0), fingers=1, hard=1.0, rest=""):
    finger = "[[finger]]\n" * fingers
    floats = lambda v: "[" + ", ".join(f"{float(x)!r}" for x in v) + "]"
    return f"""{finger}
[[entity]]
name = "table"
shape = {{ kind = "plane", normal = {floats(normal)}, offset_m = 0.0 }}
stiffness_n_per_m = {2000.0 * hard!r}
damping_n_s_per_m = 2.0
friction = {{ model = "coulomb", mu = {mu} }}
[[entity]]
name = "it"
shape = {shape}
position_m = {floats(pos)}
orientation_wxyz = {floats(quat)}
mass_kg = {mass}
stiffness_n_per_m = {1000.0 * hard!r}
friction = {{ model = "coulomb", mu = {mu} }}
{rest}"""


def hand(seconds, hips=None):
    count = len(hips(0)) if hips else 1
    lines = ["t," + ",".join(f"f{i}_{axis}" for i in range(count) for axis in "xyz")]
    for tick in range(round(seconds * 100) + 1):
        t = tick / 100
        at = hips(t) if hips else [(1, 1, 1)]
        lines.append(f"{t!r}," + ",".join(f"{x!r}" for hip in at for x in map(float, hip)))
    return "\n".join(lines) + "\n"


def smooth(t, start, end):
    return 0.5 - 0.5 * math.cos(math.pi * min(max((t - start) / (end - start), 0), 1))


def lean(angle):
    """A slope about z: its normal, a quaternion along it, and a point of the box's middle over it."""
    return (-math.sin(angle), math.cos(angle), 0), (math.cos(angle / 2), 0, 0, math.sin(angle / 2))


def yaw(quaternions):
    w, x, y, z = quaternions.T
    return 2 * np.arctan2(y, w)


def ours_pose(out):
    return (np.stack([out[f"it_{a}"] for a in "xyz"], 1), np.stack([out[f"it_q{a}"] for a in "wxyz"], 1))


def drop(phantom3):
    case = Case("drop: a cube from 100 mm, on a corner")
    quat = np.array([1.0, 0.3, 0.2, 0.1])
    quat /= np.linalg.norm(quat)
    pos = (0, 0.1, 0)
    shape = f'{{ kind = "box", size_m = [{EDGE}, {EDGE}, {EDGE}] }}'
    p, q = ours_pose(run_ours(phantom3, scene(shape, MASS, pos, 0.5, quat), hand(3)))
    P, Q = run_theirs(box([EDGE] * 3, MASS, pos, quat), 3, 0.5)
    tick = 80
    case.compare("height after 80 ms in the air", "mm", p[tick, 1] * 1e3, P[tick, 1] * 1e3, 0.2, "0.2 ms steps: g t dt / 2")
    case.compare("height at rest", "mm", p[-1, 1] * 1e3, P[-1, 1] * 1e3, SUNK * 1e3 + 0.1, "our springs sink by 0.37 mm")
    upright = lambda quats: max(abs(_matrix(quats[-1])[1]))
    case.compare("steepest axis at rest, cosine", "", upright(q), upright(Q), 1e-4, "flat on one of its faces")
    return case


def _matrix(q):
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def slide(phantom3):
    case = Case("slide: a cube pushed off at 0.5 m/s, mu = 0.4; down a slope of 0.6 rad, mu = 0.5")
    shape = f'{{ kind = "box", size_m = [{EDGE}, {EDGE}, {EDGE}] }}'
    pos = (0, EDGE / 2 - SUNK, 0)
    p, _ = ours_pose(run_ours(phantom3, scene(shape, MASS, pos, 0.4, rest="velocity_m_s = [0.5, 0.0, 0.0]"), hand(1)))
    P, _ = run_theirs(box([EDGE] * 3, MASS, (0, EDGE / 2, 0)), 1, 0.4, v0=[0.5, 0, 0])
    case.compare("stopping distance", "mm", p[-1, 0] * 1e3, P[-1, 0] * 1e3, 1.2, "v^2 / 2 mu g = 31.86; ours: half a tick of 0.5 m/s, springs of 0.25 mm that draw back")
    angle = 0.6
    normal, quat = lean(angle)
    middle = lambda sunk: [(EDGE / 2 - sunk) * n for n in normal]
    p, _ = ours_pose(run_ours(phantom3, scene(shape, MASS, middle(SUNK * math.cos(angle)), 0.5, quat, normal), hand(0.5)))
    P, _ = run_theirs(box([EDGE] * 3, MASS, middle(0), quat), 0.5, 0.5, normal)
    acceleration = lambda p: np.linalg.norm(p[450] - 2 * p[300] + p[150]) / 0.15**2
    case.compare("acceleration down the slope", "m/s^2", acceleration(p), acceleration(P), 0.03, "MuJoCo's regularised friction")
    return case


def tip(phantom3):
    size, mass = (0.04, 0.12, 0.04), 0.2
    threshold = math.atan(size[0] / size[1])
    case = Case(f"tip: a box of {size[0]} x {size[1]} m on a slope; its edge is under its middle at {math.degrees(threshold):.2f} degrees")
    shape = f'{{ kind = "box", size_m = [{size[0]}, {size[1]}, {size[2]}] }}'
    for share in (0.9, 1.1):
        angle = threshold * share
        normal, quat = lean(angle)
        sunk = mass * G * math.cos(angle) / (4 * 2000 / 3 * 10)
        middle = lambda sunk: [(size[1] / 2 - sunk) * n for n in normal]
        p, q = ours_pose(run_ours(phantom3, scene(shape, mass, middle(sunk), 2.0, quat, normal, hard=10.0), hand(1.5)))
        P, Q = run_theirs(box(size, mass, middle(0), quat), 1.5, 2.0, normal)
        turned = lambda q: 2 * math.degrees(math.acos(min(abs(float(np.dot(q[-1], quat))), 1)))
        if share < 1:
            case.compare("turned at nine tenths of it", "deg", turned(q), turned(Q), 0.3, "stands; on our springs of 20/3 N/mm it leans by m g h sin(a) / (k w^2), 0.18")
        else:
            case.compare("turned at eleven tenths of it", "deg", turned(q), turned(Q), 2.0, "falls on its side")
    return case


def push(phantom3):
    case = Case("push: a finger pushes a cube over the table, 100 mm in 2 s")
    shape = f'{{ kind = "box", size_m = [{EDGE}, {EDGE}, {EDGE}] }}'
    for aside in (0.0, 0.008):
        hips = lambda t, radius=0.0: [(-0.035 - radius + 0.11 * smooth(t, 0, 2), 0.02, aside)]
        p, q = ours_pose(run_ours(phantom3, scene(shape, MASS, (0, EDGE / 2 - SUNK, 0), 0.3, ), hand(2.2, hips)))
        P, Q = run_theirs(box([EDGE] * 3, MASS, (0, EDGE / 2, 0)), 2.2, 0.3, hips=lambda t: hips(t, FINGER))
        where = f"pushed {aside * 1e3:.0f} mm beside the middle"
        # Integrated without inertia, on four points that carry as statics says, with exact Coulomb friction.
        beside = "; 77.2 without inertia and creep" if aside else ""
        case.compare(f"{where}: way", "mm", p[-1, 0] * 1e3, P[-1, 0] * 1e3, 1.0 if aside == 0 else 4.0, "our finger's spring, 0.3 mm" + beside)
        case.compare(f"{where}: yaw", "deg", math.degrees(yaw(q)[-1]), math.degrees(yaw(Q)[-1]), 0.5 if aside == 0 else 7.0, "straight" if aside == 0 else "as above: 60.3 without inertia and creep")
    return case


def lift(phantom3):
    case = Case("lift: two fingers squeeze a cube, lift it by 50 mm and hold it")
    shape = f'{{ kind = "box", size_m = [{EDGE}, {EDGE}, {EDGE}] }}'

    def hips(t, reach, radius=0.0):
        x = EDGE / 2 + radius + 0.005 - (0.005 + reach) * smooth(t, 0, 0.5)
        y = EDGE / 2 + 0.05 * smooth(t, 0.7, 2.2)
        return [(x, y, 0), (-x, y, 0)]

    p, _ = ours_pose(run_ours(phantom3, scene(shape, MASS, (0, EDGE / 2 - SUNK, 0), 0.8, fingers=2), hand(3, lambda t: hips(t, 0.003))))
    # Their contacts are hard: half a millimetre squeezes as much and more.
    P, _ = run_theirs(box([EDGE] * 3, MASS, (0, EDGE / 2, 0)), 3, 0.8, hips=lambda t: hips(t, 0.0005, FINGER))
    case.compare("height held", "mm", p[-1, 1] * 1e3, P[-1, 1] * 1e3, 1.5, "our springs hang by m g / 2k = 0.5 mm; MuJoCo creeps")
    case.compare("sunk while held for 0.7 s", "mm", (p[2300, 1] - p[-1, 1]) * 1e3, 0.0, 1e-3, "friction holds for ever (not MuJoCo's, which creeps)")
    return case


def turn(phantom3):
    radius, torsional, rolling = 0.02, 2e-4, 5e-4
    case = Case(f"turn: a ball of {radius * 1e3:.0f} mm spins at 5 rad/s, and rolls at 0.1 m/s, until its friction stops it")
    shape = f'{{ kind = "sphere", radius_m = {radius} }}'
    lengths = f"torsional_friction_m = {torsional}\nrolling_friction_m = {rolling}\n"
    sunk = MASS * G / (2000 / 3 * 10)
    ball = f'<body pos="0 {radius} 0"><freejoint/><geom type="sphere" size="{radius}" mass="{MASS}" condim="6" friction="0.5 {torsional} {rolling}"/></body>'

    def both(rest, v0, mu=0.5):
        ours = ours_pose(run_ours(phantom3, scene(shape, MASS, (0, radius - sunk, 0), mu, hard=10.0, rest=lengths + rest), hand(1.5)))
        return ours, run_theirs(ball, 1.5, mu, v0=v0)

    (_, q), (_, Q) = both("angular_velocity_rad_s = [0.0, 5.0, 0.0]", [0, 0, 0, 0, 5, 0])
    case.compare("turned until it stops", "deg", math.degrees(yaw(q)[-1]), math.degrees(yaw(Q)[-1]), 2.0, "58.4 by Coulomb's law; MuJoCo's is regularised")
    (p, _), (P, _) = both("velocity_m_s = [0.1, 0.0, 0.0]\nangular_velocity_rad_s = [0.0, 0.0, -5.0]", [0.1, 0, 0, 0, 0, -5])
    case.compare("rolled until it stops", "mm", p[-1, 0] * 1e3, P[-1, 0] * 1e3, 1.5, "28.5 by Coulomb's law")
    return case


def main():
    if len(sys.argv) != 2:
        sys.exit(f"usage: {sys.argv[0]} PHANTOM3; see the head of this file")
    phantom3 = str(Path(sys.argv[1]).resolve())
    print(f"MuJoCo {mujoco.__version__}, {phantom3}")
    agree = True
    for experiment in (drop, slide, tip, push, lift, turn):
        case = experiment(phantom3)
        print(f"\n{case.name}")
        for what, unit, ours, theirs, allowed, why in case.rows:
            is_near = abs(ours - theirs) <= allowed
            agree &= is_near
            verdict = "agrees" if is_near else "DIFFERS"
            print(f"  {verdict:8}{what:48}{ours:12.4f}{theirs:12.4f} {unit:6} allowed {allowed:g}: {why}")
    print("\nall agree" if agree else "\nsome differ")
    sys.exit(0 if agree else 1)


if __name__ == "__main__":
    main()
