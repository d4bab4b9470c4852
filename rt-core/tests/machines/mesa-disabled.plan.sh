#!/bin/sh
# Prepares this machine for a real-time loop on CPU 3.
# Nothing has been changed yet. Read it, keep what you want, run it as root.
set -eu
[ "$(id -u)" = 0 ] || { echo 'run this as root' >&2; exit 1; }
# Writes a value to a file of the kernel, which may refuse it (a managed interrupt, a lockdown).
put() { printf '%s\n' "$1" > "$2" || echo "not taken: $1 > $2" >&2; }

# == Settings of the running kernel
# enable the Mesa 5i25; undo: put 0 /sys/bus/pci/devices/0000:04:00.0/enable
put 1 /sys/bus/pci/devices/0000:04:00.0/enable

# == Group of those who may run the loop
# makes the group, and whoever called sudo a member; undo: groupdel realtime
getent group realtime >/dev/null || groupadd --system realtime
[ -z "${SUDO_USER:-}" ] || usermod -aG realtime "$SUDO_USER"

# == Device files
# enable the Mesa 5i25 at each boot
# rules for udev; undo: rm /etc/udev/rules.d/70-phantom3.rules && udevadm control --reload
mkdir -p /etc/udev/rules.d
cat > /etc/udev/rules.d/70-phantom3.rules <<'END'
ACTION=="add", SUBSYSTEM=="pci", ATTR{vendor}=="0x2718", ATTR{device}=="0x5125", ATTR{enable}="1"
END
udevadm control --reload
udevadm trigger --action=add --subsystem-match=pci

# == Last
# The kernel's command line takes effect at the next boot, a new group at the next login.
# Then ask the doctor again.
