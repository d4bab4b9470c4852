#!/bin/sh
# Prepares this machine for a real-time loop on CPU 1.
# Nothing has been changed yet. Read it, keep what you want, run it as root.
set -eu
[ "$(id -u)" = 0 ] || { echo 'run this as root' >&2; exit 1; }
# Writes a value to a file of the kernel, which may refuse it (a managed interrupt, a lockdown).
put() { printf '%s\n' "$1" > "$2" || echo "not taken: $1 > $2" >&2; }
# Adds lines to a file of fix plans, each once. One that somebody else made is left alone.
mark='# made by the fix plan of io-driver doctor'
add() {
    if [ -e "$1" ] && [ "$(head -n 1 "$1")" != "$mark" ]; then
        echo "left alone, no fix plan made it: $1" >&2
        cat >/dev/null
        return 0
    fi
    mkdir -p "${1%/*}"
    [ -e "$1" ] || echo "$mark" >"$1"
    while IFS= read -r line; do
        grep -qxF -e "$line" "$1" || printf '%s\n' "$line" >>"$1"
    done
}

# == By hand: no script should do these
# - install and boot a PREEMPT_RT kernel: apt-get install linux-image-rt-amd64 (arm64: linux-image-rt-arm64)

# == Kernel command line, from the next boot on
# isolcpus=managed_irq,domain,1: keep other programs off the CPU
# nohz_full=1: stop the tick while the loop alone runs
# rcu_nocbs=1: move deferred clean-up to other CPUs
# irqaffinity=0: send interrupts to the other CPUs from the start
# pcie_aspm.policy=performance: keep PCIe links awake from the start
# No boot loader was found that this plan knows; whatever starts the kernel should give it:
# isolcpus=managed_irq,domain,1 nohz_full=1 rcu_nocbs=1 irqaffinity=0 pcie_aspm.policy=performance

# == Kernel parameters
# kernel.sched_rt_runtime_us: never stop a real-time thread (one that runs wild then keeps its CPU); undo: sysctl -w kernel.sched_rt_runtime_us=950000
sysctl -w kernel.sched_rt_runtime_us=-1
# kernel.watchdog: no lock-up watchdogs; undo: sysctl -w kernel.watchdog=1
sysctl -w kernel.watchdog=0
# kernel.timer_migration: leave timers where they are; undo: sysctl -w kernel.timer_migration=1
sysctl -w kernel.timer_migration=0
# the same after each boot; undo: rm /etc/sysctl.d/90-phantom3-plan.conf
add /etc/sysctl.d/90-phantom3-plan.conf <<'END'
kernel.sched_rt_runtime_us = -1
kernel.watchdog = 0
kernel.timer_migration = 0
END

# == Settings of the running kernel
# reserve nothing for ordinary threads on this CPU (before: mount -t debugfs none /sys/kernel/debug); undo: put 50000000 /sys/kernel/debug/sched/fair_server/cpu1/runtime
put 0 /sys/kernel/debug/sched/fair_server/cpu1/runtime
# send interrupt 25 (ACPI:Ged) elsewhere; undo: put 0-1 /proc/irq/25/smp_affinity_list
put 0 /proc/irq/25/smp_affinity_list
# send interrupt 26 (ttyS0) elsewhere; undo: put 0-1 /proc/irq/26/smp_affinity_list
put 0 /proc/irq/26/smp_affinity_list
# send interrupt 29 (virtio0-inflate) elsewhere; undo: put 0-1 /proc/irq/29/smp_affinity_list
put 0 /proc/irq/29/smp_affinity_list
# send interrupt 31 (virtio0-stats) elsewhere; undo: put 0-1 /proc/irq/31/smp_affinity_list
put 0 /proc/irq/31/smp_affinity_list
# send interrupt 33 (virtio4-config) elsewhere; undo: put 0-1 /proc/irq/33/smp_affinity_list
put 0 /proc/irq/33/smp_affinity_list
# send interrupt 35 (virtio1-config) elsewhere; undo: put 0-1 /proc/irq/35/smp_affinity_list
put 0 /proc/irq/35/smp_affinity_list
# send interrupt 38 (virtio2-input.0) elsewhere; undo: put 0-1 /proc/irq/38/smp_affinity_list
put 0 /proc/irq/38/smp_affinity_list
# send interrupt 40 (virtio3-config) elsewhere; undo: put 0-1 /proc/irq/40/smp_affinity_list
put 0 /proc/irq/40/smp_affinity_list
# send interrupt 42 (virtio3-tx) elsewhere; undo: put 0-1 /proc/irq/42/smp_affinity_list
put 0 /proc/irq/42/smp_affinity_list
# send new devices' interrupts elsewhere; undo: put 3 /proc/irq/default_smp_affinity
put 1 /proc/irq/default_smp_affinity
# keep unbound kernel work off the CPU; undo: put 3 /sys/devices/virtual/workqueue/cpumask
put 1 /sys/devices/virtual/workqueue/cpumask
# keep PCIe links awake; undo: put default /sys/module/pcie_aspm/parameters/policy
put performance /sys/module/pcie_aspm/parameters/policy
# This machine does not run systemd: let whatever it runs at boot do the same, that is
# echo 0 > /sys/kernel/debug/sched/fair_server/cpu1/runtime
# echo 1 > /proc/irq/default_smp_affinity
# echo 1 > /sys/devices/virtual/workqueue/cpumask
# echo performance > /sys/module/pcie_aspm/parameters/policy

# == Last
# The kernel's command line takes effect at the next boot, a new group at the next login.
# Then ask the doctor again.
