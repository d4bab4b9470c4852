#!/bin/sh
# Prepares this machine for a real-time loop on CPU 3.
# Nothing has been changed yet. Read it, keep what you want, run it as root.
set -eu
[ "$(id -u)" = 0 ] || { echo 'run this as root' >&2; exit 1; }
# Writes a value to a file of the kernel, which may refuse it (a managed interrupt, a lockdown).
put() { printf '%s\n' "$1" > "$2" || echo "not taken: $1 > $2" >&2; }

# == Group of those who may run the loop
# makes the group, and whoever called sudo a member; undo: groupdel realtime
getent group realtime >/dev/null || groupadd --system realtime
[ -z "${SUDO_USER:-}" ] || usermod -aG realtime "$SUDO_USER"

# == Cards that a kernel driver holds
# take the PHANToM PCI card from the kernel's driver; undo: put 0000:05:02.0 /sys/bus/pci/drivers/phantom/bind
put 0000:05:02.0 /sys/bus/pci/drivers/phantom/unbind
# not loaded at the next boot; undo: rm /etc/modprobe.d/phantom3.conf && modprobe phantom
mkdir -p /etc/modprobe.d
cat > /etc/modprobe.d/phantom3.conf <<'END'
blacklist phantom
END

# == Device files
# enable the PHANToM PCI card at each boot
# let the group map the PHANToM PCI card
# rules for udev; undo: rm /etc/udev/rules.d/70-phantom3.rules && udevadm control --reload
mkdir -p /etc/udev/rules.d
cat > /etc/udev/rules.d/70-phantom3.rules <<'END'
ACTION=="add", SUBSYSTEM=="pci", ATTR{vendor}=="0x10b5", ATTR{device}=="0x9050", ATTR{subsystem_vendor}=="0x10b5", ATTR{subsystem_device}=="0x9050", ATTR{enable}="1"
ACTION=="add", SUBSYSTEM=="pci", ATTR{vendor}=="0x10b5", ATTR{device}=="0x9050", ATTR{subsystem_vendor}=="0x10b5", ATTR{subsystem_device}=="0x9050", RUN+="/bin/chgrp realtime /sys$devpath/resource0 /sys$devpath/resource2 /sys$devpath/resource3", RUN+="/bin/chmod 0660 /sys$devpath/resource0 /sys$devpath/resource2 /sys$devpath/resource3"
END
udevadm control --reload
udevadm trigger --action=add --subsystem-match=pci

# == Last
# The kernel's command line takes effect at the next boot, a new group at the next login.
# Then ask the doctor again.
