#!/bin/sh
# Prepares this machine for a real-time loop on CPU 7.
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
# isolcpus=managed_irq,domain,7: keep other programs off the CPU
# nohz_full=7: stop the tick while the loop alone runs
# rcu_nocbs=7: move deferred clean-up to other CPUs
# irqaffinity=0-6: send interrupts to the other CPUs from the start
# pcie_aspm.policy=performance: keep PCIe links awake from the start
# adds them for GRUB, each unless its key is there; undo: rm /etc/default/grub.d/zz-phantom3-plan.cfg && update-grub
add /etc/default/grub.d/zz-phantom3-plan.cfg <<'END'
case " $GRUB_CMDLINE_LINUX $GRUB_CMDLINE_LINUX_DEFAULT " in *" isolcpus="* | *" isolcpus "*) ;; *) GRUB_CMDLINE_LINUX_DEFAULT="$GRUB_CMDLINE_LINUX_DEFAULT isolcpus=managed_irq,domain,7" ;; esac
case " $GRUB_CMDLINE_LINUX $GRUB_CMDLINE_LINUX_DEFAULT " in *" nohz_full="* | *" nohz_full "*) ;; *) GRUB_CMDLINE_LINUX_DEFAULT="$GRUB_CMDLINE_LINUX_DEFAULT nohz_full=7" ;; esac
case " $GRUB_CMDLINE_LINUX $GRUB_CMDLINE_LINUX_DEFAULT " in *" rcu_nocbs="* | *" rcu_nocbs "*) ;; *) GRUB_CMDLINE_LINUX_DEFAULT="$GRUB_CMDLINE_LINUX_DEFAULT rcu_nocbs=7" ;; esac
case " $GRUB_CMDLINE_LINUX $GRUB_CMDLINE_LINUX_DEFAULT " in *" irqaffinity="* | *" irqaffinity "*) ;; *) GRUB_CMDLINE_LINUX_DEFAULT="$GRUB_CMDLINE_LINUX_DEFAULT irqaffinity=0-6" ;; esac
case " $GRUB_CMDLINE_LINUX $GRUB_CMDLINE_LINUX_DEFAULT " in *" pcie_aspm.policy="* | *" pcie_aspm.policy "*) ;; *) GRUB_CMDLINE_LINUX_DEFAULT="$GRUB_CMDLINE_LINUX_DEFAULT pcie_aspm.policy=performance" ;; esac
END
update-grub

# == Service irqbalance.service
# stop moving interrupts about; undo: systemctl enable --now irqbalance.service
systemctl disable --now irqbalance.service

# == Swap
# no swapping; undo: swapon -a
# To keep it off, put a # before the swap lines of /etc/fstab.
swapoff -a

# == Kernel parameters
# kernel.sched_rt_runtime_us: never stop a real-time thread (one that runs wild then keeps its CPU); undo: sysctl -w kernel.sched_rt_runtime_us=950000
sysctl -w kernel.sched_rt_runtime_us=-1
# kernel.watchdog: no lock-up watchdogs; undo: sysctl -w kernel.watchdog=1
sysctl -w kernel.watchdog=0
# kernel.timer_migration: leave timers where they are; undo: sysctl -w kernel.timer_migration=1
sysctl -w kernel.timer_migration=0
# vm.compact_unevictable_allowed: leave locked pages where they are; undo: sysctl -w vm.compact_unevictable_allowed=1
sysctl -w vm.compact_unevictable_allowed=0
# the same after each boot; undo: rm /etc/sysctl.d/90-phantom3-plan.conf
add /etc/sysctl.d/90-phantom3-plan.conf <<'END'
kernel.sched_rt_runtime_us = -1
kernel.watchdog = 0
kernel.timer_migration = 0
vm.compact_unevictable_allowed = 0
END

# == Settings of the running kernel
# reserve nothing for ordinary threads on this CPU; undo: put 50000000 /sys/kernel/debug/sched/fair_server/cpu7/runtime
put 0 /sys/kernel/debug/sched/fair_server/cpu7/runtime
# send interrupt 145 (iwlwifi) elsewhere; undo: put 0-7 /proc/irq/145/smp_affinity_list
put 0-6 /proc/irq/145/smp_affinity_list
# send interrupt 152 (i915) elsewhere; undo: put 7 /proc/irq/152/smp_affinity_list
put 0-6 /proc/irq/152/smp_affinity_list
# send new devices' interrupts elsewhere; undo: put ff /proc/irq/default_smp_affinity
put 7f /proc/irq/default_smp_affinity
# keep unbound kernel work off the CPU; undo: put ff /sys/devices/virtual/workqueue/cpumask
put 7f /sys/devices/virtual/workqueue/cpumask
# make huge pages only for programs that ask; undo: put always /sys/kernel/mm/transparent_hugepage/enabled
put madvise /sys/kernel/mm/transparent_hugepage/enabled
# switch the sibling off; undo: put 1 /sys/devices/system/cpu/cpu3/online
put 0 /sys/devices/system/cpu/cpu3/online
# full frequency for the loop's CPU; undo: put powersave /sys/devices/system/cpu/cpu7/cpufreq/scaling_governor
put performance /sys/devices/system/cpu/cpu7/cpufreq/scaling_governor
# performance before energy on the loop's CPU; undo: put balance_performance /sys/devices/system/cpu/cpu7/cpufreq/energy_performance_preference
put performance /sys/devices/system/cpu/cpu7/cpufreq/energy_performance_preference
# keep PCIe links awake; undo: put default /sys/module/pcie_aspm/parameters/policy
put performance /sys/module/pcie_aspm/parameters/policy
# do not switch this graphics card off; undo: put auto /sys/class/drm/card0/device/power/control
put on /sys/class/drm/card0/device/power/control
# the same after each boot; undo: systemctl disable phantom3-plan-settings.service && rm /etc/systemd/system/phantom3-plan-settings.service
add /etc/systemd/system/phantom3-plan-settings.service <<'END'
[Unit]
Description=Settings for a real-time loop
After=sys-kernel-debug.mount
[Install]
WantedBy=multi-user.target
[Service]
Type=oneshot
ExecStart=-/bin/sh -c 'echo 0 > /sys/kernel/debug/sched/fair_server/cpu7/runtime'
ExecStart=-/bin/sh -c 'echo 7f > /proc/irq/default_smp_affinity'
ExecStart=-/bin/sh -c 'echo 7f > /sys/devices/virtual/workqueue/cpumask'
ExecStart=-/bin/sh -c 'echo madvise > /sys/kernel/mm/transparent_hugepage/enabled'
ExecStart=-/bin/sh -c 'echo 0 > /sys/devices/system/cpu/cpu3/online'
ExecStart=-/bin/sh -c 'echo performance > /sys/devices/system/cpu/cpu7/cpufreq/scaling_governor'
ExecStart=-/bin/sh -c 'echo performance > /sys/devices/system/cpu/cpu7/cpufreq/energy_performance_preference'
ExecStart=-/bin/sh -c 'echo performance > /sys/module/pcie_aspm/parameters/policy'
ExecStart=-/bin/sh -c 'echo on > /sys/class/drm/card0/device/power/control'
END
systemctl daemon-reload
systemctl enable phantom3-plan-settings.service

# == Kernel module msr
# let root read the SMI count; undo: rmmod msr
modprobe msr || echo 'no module msr' >&2

# == Group of those who may run the loop
# makes the group, and whoever called sudo a member; undo: groupdel phantom3
getent group phantom3 >/dev/null || groupadd --system phantom3
[ -z "${SUDO_USER:-}" ] || usermod -aG phantom3 "$SUDO_USER"

# == Rights: real-time priority and locked memory
# for members of the group, from their next login on; undo: rm /etc/security/limits.d/90-phantom3-plan.conf
add /etc/security/limits.d/90-phantom3-plan.conf <<'END'
@phantom3 - rtprio 95
@phantom3 - memlock unlimited
END
# Or, for the program whoever runs it, again after each build; undo: setcap -r PROGRAM:
# setcap cap_sys_nice,cap_ipc_lock=ep /usr/local/bin/io-driver

# == Device files
# let the group keep the CPUs awake
# rules for udev, read by udevadm control --reload; undo: rm /etc/udev/rules.d/70-phantom3-plan.rules
add /etc/udev/rules.d/70-phantom3-plan.rules <<'END'
SUBSYSTEM=="misc", KERNEL=="cpu_dma_latency", GROUP="phantom3", MODE="0660"
END
udevadm control --reload
udevadm trigger --action=add --subsystem-match=misc

# == Last
# The kernel's command line takes effect at the next boot, a new group at the next login.
# Then ask the doctor again.
