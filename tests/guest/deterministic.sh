#!/bin/bash
# Runs a shell script in a virtual machine whose time is counted in instructions, and prints what it said.
#
#   tests/guest/deterministic.sh VMLINUZ SCRIPT [PROGRAM]...
#
# One CPU, one nanosecond an instruction: how busy the host is does not matter, and figures repeat, mostly to the byte.
# RUNS=3 does so three times and tells the checksums of what was said. The script
# finds busybox's tools, cyclictest, chrt, the programs named, and the project's configuration in /config.
set -euo pipefail

[ $# -ge 2 ] || { sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
kernel=$1
script=$2
shift 2
project=$(cd "$(dirname "$0")/../.." && pwd)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
root=$scratch/root
mkdir -p "$root"/{bin,proc,sys,dev,tmp,run,root,etc}

cp /bin/busybox "$root/bin/"
for tool in sh mount sleep cat echo grep sed awk head tail mkdir ls kill sysctl sync poweroff uname ps id cp; do
    ln -s busybox "$root/bin/$tool"
done
for program in /usr/bin/cyclictest /usr/bin/chrt "$@"; do
    # Without what debuggers read, most of it, which the guest would have to unpack.
    strip -g -o "$root/bin/$(basename "$program")" "$program"
    # The loader and the libraries, where this machine has them.
    ldd "$program" | grep -o '/[^ ]*' | while read -r library; do
        mkdir -p "$root$(dirname "$library")"
        cp -L "$library" "$root$library"
    done
done
echo 'root:x:0:0::/root:/bin/sh' >"$root/etc/passwd"
echo 'root:x:0:' >"$root/etc/group"
cp -r "$project/config" "$root/config"
cp "$script" "$root/script"
cat >"$root/init" <<'INIT'
#!/bin/sh
export PATH=/bin HOME=/root
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t devtmpfs dev /dev
mkdir -p /dev/shm
for directory in /dev/shm /tmp /run; do mount -t tmpfs tmpfs $directory; done
mount -t debugfs debugfs /sys/kernel/debug
cd /root
. /script
poweroff -f
INIT
chmod +x "$root/init"
# The same archive from the same files, whenever it is made.
find "$root" -exec touch -h -d @1700000000 {} +
(cd "$root" && find . | LC_ALL=C sort | cpio --quiet --reproducible -o -H newc) | gzip -n -1 >"$scratch/initrd"

for run in $(seq "${RUNS:-1}"); do
    timeout "${LIMIT_S:-900}" qemu-system-x86_64 -accel tcg,thread=single -icount shift=0,sleep=off \
        -rtc clock=vm,base=2026-01-01 -cpu max,-rdrand,-rdseed -M q35 -smp 1 -m 768M -display none -nodefaults \
        -no-reboot -net none -serial stdio -kernel "$kernel" -initrd "$scratch/initrd" \
        -append "console=ttyS0 quiet panic=-1 nokaslr" </dev/null | sed -u 's/\r//g' >"$scratch/said-$run"
done
cat "$scratch/said-1"
if [ "${RUNS:-1}" != 1 ]; then (cd "$scratch" && md5sum said-*); fi
