#!/bin/sh
# Installs phantom3 on a laboratory's workstation, or takes it away again. It copies files and does nothing else;
# what is left to do is told at the end. `install.sh --help` lists the options.
#
# Every file copied stands in a manifest with its checksum. A file below /etc that differs from what was copied has
# been edited: it is kept, and the newer version put beside it as FILE.new.
set -u

source_dir=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd) || exit 1
project_dir=$source_dir/../..
prefix=/usr/local
destdir=
binaries=${CARGO_TARGET_DIR:-$project_dir/target}/release
loop_cpu=
fast_cpu=
cpu_count=
action=install
dry_run=false
purge=false
is_copying=false
changes=0
edited=0

help() {
    cat <<'END'
usage: install.sh [OPTIONS]
  --cpu N          CPU of the driver's loop (default: as installed before, else the last one); not CPU 0
  --fast-cpu N     keep CPU N free for the application's fast thread as well; another one than --cpu
  --cpus N         how many CPUs the machine has (default: as many as this one), for a --destdir that another boots
  --binaries DIR   where io-driver and phantom3 were built (default: target/release)
  --prefix DIR     programs go below it (default: /usr/local); configuration goes to /etc
  --destdir DIR    pretend that DIR is the root directory
  --dry-run        say what would be done
  --uninstall      remove what was installed, but not what was edited
  --purge          with --uninstall: that as well
END
}

main() {
    read_arguments "$@"
    manifest=$prefix/share/phantom3/installed
    scratch=$(mktemp -d) || exit 1
    trap 'finish' EXIT
    trap 'exit 130' HUP INT PIPE TERM
    : >"$scratch/manifest"
    : >"$scratch/directories"
    if [ -e "$destdir$manifest" ]; then cp "$destdir$manifest" "$scratch/former"; else : >"$scratch/former"; fi
    if [ "$action" = install ]; then install_all; else uninstall_all; fi
}

# What was copied before an interruption is on record, so that it can be taken away again.
finish() {
    if $is_copying; then
        while read -r kind sum path; do
            if [ "$kind" != directory ] && ! grep -qF " $path" "$scratch/manifest"; then record "$kind" "$sum" "$path"; fi
        done <"$scratch/former"
        write_manifest
    fi
    rm -rf "$scratch"
}

read_arguments() {
    while [ $# -gt 0 ]; do
        case $1 in
        --cpu | --fast-cpu | --cpus | --binaries | --prefix | --destdir)
            [ $# -gt 1 ] || fail "$1 needs a value"
            set_option "$1" "$2"
            shift
            ;;
        --dry-run) dry_run=true ;;
        --uninstall) action=uninstall ;;
        --purge) purge=true ;;
        --help) help && exit 0 ;;
        *) fail "unknown option $1; install.sh --help lists those there are" ;;
        esac
        shift
    done
    if $purge && [ "$action" = install ]; then fail "--purge belongs to --uninstall"; fi
}

set_option() {
    case $1 in
    --cpu | --fast-cpu | --cpus)
        case $2 in
        # A shell would take what begins with 0 for octal.
        "" | *[!0-9]* | 0?* | ??????*) fail "$1: found \`$2\`, allowed: a number, such as 3" ;;
        esac
        case $1 in
        --cpu) loop_cpu=$2 ;;
        --fast-cpu) fast_cpu=$2 ;;
        --cpus) cpu_count=$2 ;;
        esac
        ;;
    --binaries) binaries=$2 ;;
    --prefix | --destdir)
        # They are written into other files, by sed.
        case $2 in
        /*[!A-Za-z0-9/._+-]* | [!/]* | "") fail "$1: found \`$2\`, allowed: an absolute path of plain characters" ;;
        esac
        if [ "$1" = --prefix ]; then prefix=${2%/}; else destdir=${2%/}; fi
        ;;
    esac
}

fail() {
    echo "install.sh: $*" >&2
    exit 2
}

# --- installing ---------------------------------------------------------------------------------------------

# The one list of what is installed, and where.
files() {
    copy program "$binaries/io-driver" "$prefix/bin/io-driver"
    copy program "$binaries/phantom3" "$prefix/bin/phantom3"
    copy program "$source_dir/libexec/phantom3-machine" "$prefix/libexec/phantom3/phantom3-machine"
    copy program "$source_dir/libexec/phantom3-card" "$prefix/libexec/phantom3/phantom3-card"
    copy data "$source_dir/README.md" "$prefix/share/doc/phantom3/README.md"
    copy config "$source_dir/phantom3/machine.conf" /etc/phantom3/machine.conf
    copy config "$source_dir/phantom3/driver.toml" /etc/phantom3/driver.toml
    copy config "$source_dir/systemd/phantom3-driver.service" /etc/systemd/system/phantom3-driver.service
    copy config "$source_dir/systemd/phantom3-machine.service" /etc/systemd/system/phantom3-machine.service
    copy config "$source_dir/sysusers.d/phantom3.conf" /etc/sysusers.d/phantom3.conf
    copy config "$source_dir/udev/70-phantom3.rules" /etc/udev/rules.d/70-phantom3.rules
    copy config "$source_dir/limits.d/phantom3.conf" /etc/security/limits.d/phantom3.conf
    copy config "$source_dir/sysctl.d/70-phantom3.conf" /etc/sysctl.d/70-phantom3.conf
    copy config "$source_dir/modprobe.d/phantom3.conf" /etc/modprobe.d/phantom3.conf
    copy config "$source_dir/grub.d/phantom3.cfg" /etc/default/grub.d/phantom3.cfg
    # TuneD looks in the second place since version 2.23.
    copy config "$source_dir/tuned/phantom3/tuned.conf" /etc/tuned/phantom3/tuned.conf
    copy config "$source_dir/tuned/phantom3/tuned.conf" /etc/tuned/profiles/phantom3/tuned.conf
}

install_all() {
    for name in io-driver phantom3; do
        [ -x "$binaries/$name" ] || fail "$binaries/$name is not there; build it: cargo build --release --workspace"
    done
    if ! $dry_run && [ -z "$destdir" ] && [ "$(id -u)" != 0 ]; then
        fail "needs root (sudo), or --destdir, or --dry-run"
    fi
    choose_cpus
    if ! $dry_run; then
        is_copying=true
        make_directory /
    fi
    files
    remove_what_is_no_longer_shipped
    write_manifest
    is_copying=false
    next_steps
}

# Asked for, else as it was installed (perhaps edited since), else the last CPU.
choose_cpus() {
    if [ -z "$loop_cpu" ]; then loop_cpu=$(installed_cpu LOOP_CPU); fi
    if [ -z "$fast_cpu" ]; then fast_cpu=$(installed_cpu FAST_CPU); fi
    if [ -z "$cpu_count" ]; then cpu_count=$(getconf _NPROCESSORS_CONF); fi
    [ "$cpu_count" -ge 2 ] || fail "the driver's loop needs a CPU of its own, and there is one CPU only"
    if [ -z "$loop_cpu" ]; then loop_cpu=$((cpu_count - 1)); fi
    check_cpu --cpu "$loop_cpu"
    [ -n "$fast_cpu" ] || return 0
    check_cpu --fast-cpu "$fast_cpu"
    if [ "$fast_cpu" = "$loop_cpu" ]; then
        fail "--fast-cpu: found $fast_cpu, which is the CPU of the driver's loop; choose another one, or leave it out:" \
            "then no CPU is kept free for the application's fast thread"
    fi
}

# check_cpu OPTION NUMBER: also of what stands in a machine.conf that was edited.
check_cpu() {
    case $2 in
    0 | 0?* | ??????*) known=false ;;
    *) if [ "$2" -lt "$cpu_count" ]; then known=true; else known=false; fi ;;
    esac
    $known || fail "$1: found CPU $2, allowed: 1 to $((cpu_count - 1)), those of this machine but CPU 0, which does the" \
        "kernel's housekeeping; for another machine's CPUs: --cpus"
}

# installed_cpu KEY: nothing if there is none, or what stands there is no number.
installed_cpu() {
    if [ -e "$destdir/etc/phantom3/machine.conf" ]; then
        sed -n "s/^$1=\([0-9][0-9]*\)\$/\1/p" "$destdir/etc/phantom3/machine.conf" | tail -n 1
    fi
}

# copy KIND SOURCE DESTINATION
copy() {
    rendered=$scratch/rendered
    render "$2" "$3" >"$rendered" || fail "cannot read $2"
    wanted=$(checksum "$rendered")
    # What was put there the last time; nothing if we never put anything there.
    former=$(checksum_in_manifest "$3")
    if [ ! -e "$destdir$3" ]; then
        place "$1" "$3" installed && record "$1" "$wanted" "$3"
    elif [ "$(checksum "$destdir$3")" = "$wanted" ]; then
        record "$1" "$wanted" "$3"
    elif [ "$1" != config ] || [ "$(checksum "$destdir$3")" = "$former" ]; then
        place "$1" "$3" updated && record "$1" "$wanted" "$3"
    else
        # Edited. The checksum of what was copied stays on record, so that it goes on counting as edited.
        if [ -n "$former" ]; then record "$1" "$former" "$3"; fi
        edited=$((edited + 1))
        if [ "$wanted" = "$former" ]; then tell "kept (edited)" "$3"; else put_beside "$3"; fi
    fi
}

# render SOURCE DESTINATION: fills in where the programs are, and the machine's CPUs.
render() {
    case $2 in
    "$prefix"/bin/*) cat "$1" ;;
    /etc/phantom3/*)
        sed -e "s|^cpu = .*|cpu = $loop_cpu|" -e "s|^LOOP_CPU=.*|LOOP_CPU=$loop_cpu|" \
            -e "s|^FAST_CPU=.*|FAST_CPU=$fast_cpu|" "$1"
        ;;
    *) sed "s|/usr/local|$prefix|g" "$1" ;;
    esac
}

# put_beside DESTINATION: the new version of an edited file.
put_beside() {
    if [ -e "$destdir$1.new" ] && [ "$(checksum "$destdir$1.new")" = "$wanted" ]; then
        tell "kept (edited)" "$1; the new version is beside it"
    else
        place config "$1.new" "kept the edited ${1##*/}, new version:"
    fi
    record new "$wanted" "$1.new"
}

# place KIND DESTINATION WORD: by renaming, so that a running program can be replaced.
place() {
    tell "$3" "$2"
    changes=$((changes + 1))
    $dry_run && return
    if [ "$1" = program ]; then mode=755; else mode=644; fi
    make_directory "$(dirname "$2")"
    if ! { cp "$rendered" "$destdir$2.installing" && chmod "$mode" "$destdir$2.installing" &&
        mv "$destdir$2.installing" "$destdir$2"; }; then
        fail "cannot write $destdir$2"
    fi
}

# Records the directories that were not there, the outer ones first; `/` is the --destdir itself, `/..` what it lies in.
make_directory() {
    [ -d "$destdir$1" ] && return
    if [ "$1" = / ]; then
        make_around "$(dirname "$destdir")" /..
        [ -d "$destdir" ] || mkdir "$destdir" || fail "cannot make $destdir"
    else
        make_directory "$(dirname "$1")"
        mkdir "$destdir$1" || fail "cannot make $destdir$1"
    fi
    chmod 755 "$destdir$1" || fail "cannot open $destdir$1 to everybody"
    echo "directory - $1" >>"$scratch/directories"
}

# make_around DIRECTORY RECORDED_AS
make_around() {
    [ -d "$1" ] && return
    make_around "$(dirname "$1")" "$2/.."
    # One that ends in `..` is there now.
    [ -d "$1" ] && return
    mkdir "$1" || fail "cannot make $1"
    echo "directory - $2" >>"$scratch/directories"
}

# Where a directory lies that was recorded so.
directory_at() {
    case $1 in
    */..) dirname "$(directory_at "${1%/..}")" ;;
    *) echo "$destdir$1" ;;
    esac
}

remove_what_is_no_longer_shipped() {
    while read -r kind sum path; do
        if [ "$kind" != directory ] && ! grep -q " $path\$" "$scratch/manifest"; then
            remove "$kind" "$sum" "$path"
        fi
    done <"$scratch/former"
}

write_manifest() {
    $dry_run && return
    rendered=$scratch/whole
    make_directory "$(dirname "$manifest")"
    { grep '^directory ' "$scratch/former"; cat "$scratch/directories" "$scratch/manifest"; } >"$rendered"
    cp "$rendered" "$destdir$manifest" || fail "cannot write $destdir$manifest"
}

# record KIND CHECKSUM PATH
record() {
    echo "$1 $2 $3" >>"$scratch/manifest"
}

checksum() {
    cksum <"$1" | tr ' ' -
}

checksum_in_manifest() {
    while read -r _ sum path; do
        if [ "$path" = "$1" ]; then echo "$sum"; fi
    done <"$scratch/former"
}

# tell WORD PATH
tell() {
    if $dry_run; then echo "would: $1 $destdir$2"; else echo "$1 $destdir$2"; fi
}

next_steps() {
    if [ "$edited" != 0 ]; then
        echo "kept: $edited edited; to have one as it is shipped, remove it and install again"
    elif [ "$changes" = 0 ]; then
        echo "everything is in its place already"
    fi
    cat <<END

CPU $loop_cpu is the driver's (/etc/phantom3/machine.conf and driver.toml). Next, as root:
  systemd-sysusers                          # makes the user and group phantom3
  adduser YOUR_NAME phantom3                # whoever may command the devices
  update-grub                               # keeps the CPU free from the next boot on
  reboot
and then:
  systemctl start phantom3-machine          # what is set at run time; the journal says what could not be
  io-driver doctor                          # what is still missing
  systemctl enable --now phantom3-driver
  io-driver status
END
}

# --- uninstalling -------------------------------------------------------------------------------------------

uninstall_all() {
    [ -e "$destdir$manifest" ] || fail "nothing is installed: there is no $destdir$manifest"
    if ! $dry_run && [ -z "$destdir" ]; then
        [ "$(id -u)" = 0 ] || fail "needs root (sudo), or --dry-run"
        stop_services
    fi
    while read -r kind sum path; do
        if [ "$kind" != directory ]; then remove "$kind" "$sum" "$path"; fi
    done <"$scratch/former"
    if $dry_run; then return; fi
    remember_what_is_kept
    # The inner ones first. One that holds something else stays.
    sed -n '1!G;h;$p' "$scratch/former" | while read -r kind _ path; do
        if [ "$kind" = directory ]; then rmdir "$(directory_at "$path")" 2>/dev/null; fi
    done
    cat <<END

Next, as root:
  update-grub
  userdel phantom3
  getent group phantom3 && groupdel phantom3    # userdel leaves a group that has members
  reboot
END
}

# What was edited stays, and can be purged later.
remember_what_is_kept() {
    : >"$scratch/kept"
    while read -r kind sum path; do
        if [ "$kind" = config ] && [ -e "$destdir$path" ]; then echo "$kind $sum $path" >>"$scratch/kept"; fi
    done <"$scratch/former"
    if [ -s "$scratch/kept" ]; then
        { grep '^directory ' "$scratch/former"; cat "$scratch/kept"; } >"$destdir$manifest"
    else
        rm -f "$destdir$manifest"
    fi
}

stop_services() {
    if [ -d /run/systemd/system ]; then
        systemctl disable --now phantom3-driver.service phantom3-machine.service
    fi
}

# remove KIND CHECKSUM PATH
remove() {
    [ -e "$destdir$3" ] || return 0
    if [ "$1" = config ] && ! $purge && [ "$(checksum "$destdir$3")" != "$2" ]; then
        tell "kept (edited)" "$3"
        return
    fi
    tell removed "$3"
    $dry_run || rm -f "$destdir$3"
}

main "$@"
