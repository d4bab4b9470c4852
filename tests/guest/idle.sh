# For deterministic.sh: driver and application on one idle CPU; every tick is answered, also the last ones.
sysctl -w kernel.sched_rt_runtime_us=-1
[ ! -e /sys/kernel/debug/sched/fair_server ] || echo 0 >/sys/kernel/debug/sched/fair_server/cpu0/runtime
phantom3 run /config/scenes/lift.toml --headless --hand-mode impedance --seconds 5 --record lift.csv 2>/dev/null
phantom3 run /config/scenes/plane.toml --headless --seconds 5 --record plane.csv 2>/dev/null
