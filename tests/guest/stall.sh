# For deterministic.sh: a loop of the highest priority takes the CPU from the driver and from cyclictest.
sysctl -w kernel.sched_rt_runtime_us=-1
[ ! -e /sys/kernel/debug/sched/fair_server ] || echo 0 >/sys/kernel/debug/sched/fair_server/cpu0/runtime
printf '[[device]]\nname = "f0"\nbackend = "ideal"\n' >driver.toml
io-driver run --config driver.toml --socket /tmp/driver.sock 2>driver.log &
sleep 1
cyclictest -q -m -t1 -p85 -i1000 -D4 -h200000 >cyclictest.txt &
sleep 1
io-driver status --socket /tmp/driver.sock | grep -E '^(ticks|wake error)'
chrt -f 99 sh -c 'i=0; while [ $i -lt 7250 ]; do i=$((i + 1)); done'
sleep 4
io-driver status --socket /tmp/driver.sock | grep -E '^(ticks|wake error)'
grep 'Max Latencies' cyclictest.txt
io-driver stop --socket /tmp/driver.sock
