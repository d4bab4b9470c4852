#!/bin/sh
# Prepares this machine for a real-time loop on CPU 3.
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

# == Group of those who may run the loop
# makes the group, and whoever called sudo a member; undo: groupdel phantom3
getent group phantom3 >/dev/null || groupadd --system phantom3
[ -z "${SUDO_USER:-}" ] || usermod -aG phantom3 "$SUDO_USER"

# == Cards that a kernel driver holds
# take the PHANToM PCI card from the kernel's driver; undo: put 0000:05:02.0 /sys/bus/pci/drivers/phantom/bind
put 0000:05:02.0 /sys/bus/pci/drivers/phantom/unbind
# after undoing what follows: modprobe phantom
# not loaded at the next boot; undo: rm /etc/modprobe.d/phantom3-plan.conf
add /etc/modprobe.d/phantom3-plan.conf <<'END'
blacklist phantom
END

# == Device files
# enable the PHANToM PCI card at each boot
# let the group map the PHANToM PCI card
# rules for udev, read by udevadm control --reload; undo: rm /etc/udev/rules.d/70-phantom3-plan.rules
add /etc/udev/rules.d/70-phantom3-plan.rules <<'END'
ACTION=="add", SUBSYSTEM=="pci", ATTR{vendor}=="0x10b5", ATTR{device}=="0x9050", ATTR{subsystem_vendor}=="0x10b5", ATTR{subsystem_device}=="0x9050", ATTR{enable}="1"
ACTION=="add", SUBSYSTEM=="pci", ATTR{vendor}=="0x10b5", ATTR{device}=="0x9050", ATTR{subsystem_vendor}=="0x10b5", ATTR{subsystem_device}=="0x9050", RUN+="/bin/chgrp phantom3 /sys$devpath/resource0 /sys$devpath/resource2 /sys$devpath/resource3", RUN+="/bin/chmod 0660 /sys$devpath/resource0 /sys$devpath/resource2 /sys$devpath/resource3"
END
udevadm control --reload
udevadm trigger --action=add --subsystem-match=pci

# == Last
# The kernel's command line takes effect at the next boot, a new group at the next login.
# Then ask the doctor again.
