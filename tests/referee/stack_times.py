#!/usr/bin/env python3
"""Time that MuJoCo takes for a tick of 1 ms of stacks whose top cube is as heavy as so many, and whether they stand.

    python3 -m venv /tmp/venv && /tmp/venv/bin/pip install mujoco
    /tmp/venv/bin/python tests/referee/stack_times.py

Beside it: `cargo bench -p physics --bench islands -- top`. Compare medians of runs that took turns. With MuJoCo's default contacts
(solref 0.02 1) stacks of 1:100 fall within three seconds; their times are those of cubes on the floor. With the stiffest that it
takes at 1 ms (0.002 1) all but those of ten stand.
"""

import statistics
import time

import mujoco

EDGE, MASS, WARM_UP, TICKS, RUNS = 0.04, 0.05, 3000, 2000, 9


def stack(masses, cone, solref):
    half = EDGE / 2
    cubes = "".join(
        f'<body pos="0 {EDGE * (place + 0.5)} 0"><freejoint/><geom type="box" size="{half} {half} {half}" mass="{mass}"/></body>'
        for place, mass in enumerate(masses)
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="0.001" gravity="0 -9.81 0" cone="{cone}"/>'
        f'<default><geom friction="0.6 0.0002 0.0002" solref="{solref}"/></default>'
        f'<worldbody><geom type="plane" size="1 1 1" euler="-90 0 0"/>{cubes}</worldbody></mujoco>'
    )


def measure(masses, cone, solref):
    model = stack(masses, cone, solref)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, WARM_UP)
    runs = []
    for _ in range(RUNS):
        begin = time.perf_counter()
        mujoco.mj_step(model, data, TICKS)
        runs.append((time.perf_counter() - begin) / TICKS * 1e6)
    top = data.qpos[-6]
    stands = abs(top - EDGE * (len(masses) - 0.5)) < 0.1 * EDGE * len(masses)
    return statistics.median(runs), stands


if __name__ == "__main__":
    for count in (2, 3, 5, 10):
        for times in (1, 100):
            for cone in ("pyramidal", "elliptic"):
                for solref in ("0.02 1", "0.002 1"):
                    masses = [MASS] * (count - 1) + [MASS * times]
                    median, stands = measure(masses, cone, solref)
                    print(f"{count:2} cubes, {times:3} times, {cone:9} solref {solref:7}: {median:5.1f} us {'stands' if stands else 'has fallen'}", flush=True)
