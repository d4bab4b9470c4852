//! What nobody may do to the memory that was handed over, and what a bad neighbour can spoil.

use crate::common::{command, info, info_of};
use bytemuck::Zeroable;
use shm_abi::segment::LeaseOffer;
use shm_abi::{Command, CommanderMemory, CommanderView, DriverMemory, DriverSegment, DriverView};
use std::fs::File;
use std::os::fd::AsFd;
use std::os::unix::fs::FileExt;

#[test]
fn whoever_is_handed_the_drivers_segment_can_neither_write_nor_resize_it() {
    let memory = DriverMemory::create(&info()).unwrap();
    let bytes = size_of::<DriverSegment>() as u64;
    let file = File::from(memory.fd().try_clone_to_owned().unwrap());
    let denied = |what: &str, result: std::io::Result<()>| {
        let error = result.expect_err(what);
        assert_eq!(error.raw_os_error(), Some(rustix::io::Errno::PERM.raw_os_error()), "{what}: {error}");
    };
    denied("map writable", memmap2::MmapOptions::new().len(4096).map_raw(&file).map(|_| ()));
    denied("write", file.write_at(&[1], 0).map(|_| ()));
    denied("shrink", file.set_len(bytes - 4096));
    denied("grow", file.set_len(bytes + 4096));
    let hole = rustix::fs::FallocateFlags::PUNCH_HOLE | rustix::fs::FallocateFlags::KEEP_SIZE;
    denied("punch a hole", rustix::fs::fallocate(&file, hole, 0, 4096).map_err(Into::into));
    let reopened = File::options()
        .read(true)
        .write(true)
        .open(format!("/proc/self/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&file)));
    denied("write through a new description", reopened.and_then(|file| file.write_at(&[1], 0)).map(|_| ()));
    denied("unseal", rustix::fs::fcntl_add_seals(&file, rustix::fs::SealFlags::WRITE).map_err(Into::into));
}

#[test]
fn a_read_only_mapping_of_the_drivers_segment_cannot_be_made_writable() {
    let memory = DriverMemory::create(&info()).unwrap();
    let map = memmap2::MmapOptions::new().len(4096).map_raw_read_only(&memory.fd()).unwrap();
    // SAFETY: the page is this test's own mapping; even if made writable, nothing refers to it.
    let changed =
        unsafe { rustix::mm::mprotect(map.as_mut_ptr().cast(), 4096, rustix::mm::MprotectFlags::WRITE) };
    assert_eq!(changed, Err(rustix::io::Errno::ACCESS));
}

/// Merged pages would keep the loop waiting for milliseconds; a file of the same kind, without what holds them, is merged.
#[test]
fn an_observer_cannot_have_the_pages_of_the_drivers_segment_merged() {
    let memory = DriverMemory::create(&info()).unwrap();
    let other = rustix::fs::memfd_create("other", rustix::fs::MemfdFlags::CLOEXEC).unwrap();
    rustix::fs::fallocate(&other, rustix::fs::FallocateFlags::empty(), 0, size_of::<DriverSegment>() as u64)
        .unwrap();
    if let Err(error) = merge_pages(&other, 0) {
        println!("skipped: this kernel merges no pages when asked: {error}");
        return;
    }
    for part in (0..size_of::<DriverSegment>()).step_by(HUGE) {
        assert_eq!(merge_pages(&memory.fd(), part as u64), Err(rustix::io::Errno::AGAIN), "from byte {part}");
    }
}

/// Not even when it took its page away before the seal, so that the driver's mapping began with another.
#[test]
fn a_commander_cannot_have_the_pages_of_its_own_segment_merged() {
    let sealed = |takes_away: bool| {
        let offer = LeaseOffer::create(1, shm_abi::ABI_VERSION).unwrap();
        let fd = offer.fd().try_clone_to_owned().unwrap();
        let commander = CommanderMemory::map(fd.as_fd()).unwrap();
        if takes_away {
            assert_eq!(punch(&fd, &commander), [Ok(()); 2]);
        }
        (offer.seal().unwrap(), fd)
    };
    let (_view, unsealed) = CommanderView::create(1).unwrap();
    if let Err(error) = merge_pages(&unsealed, 0) {
        println!("skipped: this kernel merges no pages when asked: {error}");
        return;
    }
    for takes_away in [false, true] {
        let (_view, fd) = sealed(takes_away);
        assert_eq!(merge_pages(&fd, 0), Err(rustix::io::Errno::AGAIN), "taken away before: {takes_away}");
    }
}

const HUGE: usize = 2 << 20;

/// Asks the kernel to put the pages of a memory file from this byte on into a huge one, as whoever may map it can.
fn merge_pages(fd: &impl AsFd, from: u64) -> Result<(), rustix::io::Errno> {
    use rustix::mm::{MapFlags, ProtFlags, mmap, mmap_anonymous};
    // SAFETY: addresses that nobody uses, reserved for the mapping below.
    let room =
        unsafe { mmap_anonymous(std::ptr::null_mut(), 2 * HUGE, ProtFlags::empty(), MapFlags::PRIVATE)? };
    let at = room.map_addr(|address| address.next_multiple_of(HUGE));
    // SAFETY: all of it lies in the room.
    unsafe { mmap(at, HUGE, ProtFlags::READ, MapFlags::SHARED | MapFlags::FIXED, fd, from)? };
    // Large bases for page tables are only made where a page of the file is in place.
    // SAFETY: the file goes on behind that byte, and words that change meanwhile are not looked at.
    std::hint::black_box(unsafe { at.cast::<u8>().read_volatile() });
    // SAFETY: contents stay as they are.
    let result = unsafe { libc::madvise(at, HUGE, libc::MADV_COLLAPSE) };
    let error = rustix::io::Errno::from_io_error(&std::io::Error::last_os_error());
    // SAFETY: nothing refers to it.
    unsafe { rustix::mm::munmap(room, 2 * HUGE)? };
    if result == 0 { Ok(()) } else { Err(error.expect("an error of the kernel")) }
}

/// A loop that waits for a command is woken, and does not look for it again and again.
#[test]
fn a_driver_sleeps_for_a_command_until_its_time_is_up() {
    let memory = DriverMemory::create(&info()).unwrap();
    let (view, _fd) = CommanderView::create(1).unwrap();
    let timeout = std::time::Duration::from_millis(50);
    let began = std::time::Instant::now();
    // A signal may end a single sleep.
    (0..4).for_each(|_| view.sleep_for_command(None, &memory, timeout));
    assert!(began.elapsed() >= timeout, "{:?}", began.elapsed());
}

/// Pages that the commander took away before the seal are there again when the loop first looks at them.
#[test]
fn the_loops_first_look_at_a_sealed_segment_is_no_page_fault() {
    let faults_of_a_first_look = || {
        let offer = LeaseOffer::create(1, shm_abi::ABI_VERSION).unwrap();
        let fd = offer.fd().try_clone_to_owned().unwrap();
        let commander = CommanderMemory::map(fd.as_fd()).unwrap();
        assert_eq!(punch(&fd, &commander), [Ok(()); 2]);
        let view = offer.seal().unwrap();
        let mut found = Command::zeroed();
        let before = page_faults();
        for tick in 0..shm_abi::layout::RING_COMMANDS as u64 {
            let _ = std::hint::black_box(view.read_command(tick, &mut found));
        }
        page_faults() - before
    };
    // The first time may fault in this thread's own code.
    let faults = (0..5).map(|_| faults_of_a_first_look()).min();
    assert_eq!(faults, Some(0));
}

#[test]
fn a_commander_that_punches_a_hole_into_its_memory_only_erases_its_commands() {
    let memory = DriverMemory::create(&info()).unwrap();
    let driver = DriverView::map(memory.fd()).unwrap();
    let (view, fd) = CommanderView::create(1).unwrap();
    let commander = CommanderMemory::map(fd.as_fd()).unwrap();
    commander.publish(&command(2), &driver);
    let hole = rustix::fs::FallocateFlags::PUNCH_HOLE | rustix::fs::FallocateFlags::KEEP_SIZE;
    rustix::fs::fallocate(&fd, hole, 0, size_of::<shm_abi::CommanderSegment>() as u64).unwrap();
    let mut found = command(9);
    view.read_command(2, &mut found).unwrap();
    assert_eq!((view.latest_tick(), found), (None, Command::zeroed()));
    assert_eq!(view.lease(), 1, "the driver's own knowledge");
    assert!(File::from(fd).set_len(0).is_err(), "but it cannot shrink it, which would be SIGBUS");
}

/// Every way to take a page of the commander's segment away from under the driver.
fn punch(fd: &impl AsFd, commander: &CommanderMemory) -> [Result<(), rustix::io::Errno>; 2] {
    let bytes = size_of::<shm_abi::CommanderSegment>();
    let hole = rustix::fs::FallocateFlags::PUNCH_HOLE | rustix::fs::FallocateFlags::KEEP_SIZE;
    let page = std::ptr::from_ref::<shm_abi::CommanderSegment>(commander).cast_mut().cast();
    // SAFETY: the words may change at any time, by the rules of the segment, also to zero.
    let removed = unsafe { rustix::mm::madvise(page, bytes, rustix::mm::Advice::LinuxRemove) };
    [rustix::fs::fallocate(fd, hole, 0, bytes as u64), removed]
}

/// Page faults of this thread so far, of both kinds.
fn page_faults() -> u64 {
    use nix::sys::resource::{UsageWho, getrusage};
    let usage = getrusage(UsageWho::RUSAGE_THREAD).unwrap();
    (usage.minor_page_faults() + usage.major_page_faults()) as u64
}

/// What the loop does with a commander in each tick, while that punches holes; returns the loop's page faults.
fn faults_of_the_loop(view: &CommanderView, fd: &impl AsFd, commander: &CommanderMemory) -> u64 {
    const TICKS: u64 = 2000;
    let mut found = Command::zeroed();
    // The first looks fault in this thread's own stack and code.
    let mut tick = |k| view.read_command(k, &mut found).is_ok() && view.latest_tick().is_some();
    for k in 0..10 {
        std::hint::black_box(tick(k));
    }
    let mut faults = 0;
    for k in 0..TICKS {
        let _ = punch(fd, commander);
        let before = page_faults();
        std::hint::black_box(tick(k));
        faults += page_faults() - before;
    }
    faults
}

#[test]
fn a_commander_that_punches_holes_costs_the_loop_no_page_fault_once_the_segment_is_sealed() {
    for punches_before in [false, true] {
        let offer = LeaseOffer::create(1, shm_abi::ABI_VERSION).unwrap();
        assert!(!offer.is_mapped());
        let fd = offer.fd().try_clone_to_owned().unwrap();
        let commander = CommanderMemory::map(fd.as_fd()).unwrap();
        assert!(offer.is_mapped(), "it said so");
        if punches_before {
            assert_eq!(punch(&fd, &commander), [Ok(()); 2]);
        }
        let view = offer.seal().unwrap();
        // A page that the kernel takes away by itself comes back once, not in each of three rounds.
        let is_quiet = (0..3).any(|_| faults_of_the_loop(&view, &fd, &commander) == 0);
        assert!(is_quiet, "punched before: {punches_before}");
        assert_eq!(punch(&fd, &commander), [Err(rustix::io::Errno::PERM); 2]);
        assert!(CommanderMemory::map(fd.as_fd()).is_err(), "nobody maps it for writing again");
    }
}

#[test]
fn without_the_seal_every_hole_is_a_page_fault_of_the_loop() {
    let (view, fd) = CommanderView::create(1).unwrap();
    let commander = CommanderMemory::map(fd.as_fd()).unwrap();
    assert!(faults_of_the_loop(&view, &fd, &commander) >= 2000, "the counter sees what it is there for");
}

#[test]
fn a_commander_that_seals_its_segment_itself_gets_no_lease() {
    let offer = LeaseOffer::create(1, shm_abi::ABI_VERSION).unwrap();
    rustix::fs::fcntl_add_seals(offer.fd(), rustix::fs::SealFlags::SEAL).unwrap();
    let error = offer.seal().unwrap_err();
    assert_eq!(error.to_string(), "cannot seal a shared segment: Operation not permitted (os error 1)");
}

#[test]
fn a_commander_of_before_1_3_has_mapped_its_segment_once_it_publishes_or_has_had_time_to() {
    let driver = DriverMemory::create(&info()).unwrap();
    let driver = DriverView::map(driver.fd()).unwrap();
    let before = (1 << 32) | 2;
    let first = LeaseOffer::create(1, before).unwrap();
    let commander = CommanderMemory::map(first.fd()).unwrap();
    commander.header.mapped.store(0, std::sync::atomic::Ordering::Relaxed);
    assert!(!first.is_mapped());
    commander.publish(&command(0), &driver);
    assert!(first.is_mapped());
    let begun = std::time::Instant::now();
    let second = LeaseOffer::create(2, before).unwrap();
    crate::common::wait_until("it has had time to", || second.is_mapped());
    assert!(begun.elapsed() >= shm_abi::segment::MAPPED_WITHIN);
}

#[test]
fn a_view_tells_the_ramp_and_the_last_set_up_report_of_its_driver() {
    let memory = DriverMemory::create(&info()).unwrap();
    let view = DriverView::map(memory.fd()).unwrap();
    assert_eq!(view.ramp_in_ticks(), info().ramp_in_ticks);
    memory.tell_setup_report("obtained  locked memory");
    assert_eq!(view.info().setup_report, "obtained  locked memory");
}

#[test]
fn clocks_have_the_names_of_the_configuration() {
    use shm_abi::segment::ClockMode::{self, Lockstep, Real, Virtual};
    assert_eq!([Real, Lockstep, Virtual].map(ClockMode::name), ["real", "lockstep", "virtual"]);
}

#[test]
fn what_the_driver_says_of_itself_is_cleaned_before_it_is_shown() {
    let mut odd = info();
    odd.devices[0].name = "a\u{1b}[2J".into();
    // 64 bytes end within a character, so that one byte stays free.
    odd.devices[1].name = format!("a{}", "ä".repeat(40));
    odd.setup_report = format!("ab{}", "€".repeat(2000));
    let memory = DriverMemory::create(&odd).unwrap();
    let view = DriverView::map(memory.fd()).unwrap();
    let devices = view.info().devices;
    assert_eq!(devices[0].name, "a?[2J");
    assert_eq!(devices[1].name, format!("a{}", "ä".repeat(31)), "cut between characters");
    assert_eq!(view.info().setup_report, format!("ab{}", "€".repeat(1364)), "cut between characters");
    let order = std::sync::atomic::Ordering::Relaxed;
    memory.header.device_count.store(u64::MAX, order);
    memory.header.wait_mode.store(99, order);
    memory.header.period_ns.store(0, order);
    let info = view.info();
    assert_eq!((info.devices.len(), info.period_ns), (shm_abi::MAX_DEVICES, 50_000), "they became so later");
}

/// What an observer of the driver's own user can still do to the file itself: nothing that anybody notices.
#[test]
fn an_observer_of_the_same_user_can_spoil_neither_the_memory_nor_the_next_observers_view() {
    use std::os::unix::fs::PermissionsExt;
    let memory = DriverMemory::create(&info()).unwrap();
    let file = File::from(memory.fd().try_clone_to_owned().unwrap());
    let path = format!("/proc/self/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&file));
    // Others cannot open it again, by this path, to fill memory with its attributes.
    assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
    let truncated = File::options().write(true).truncate(true).open(&path);
    assert_eq!(truncated.unwrap_err().raw_os_error(), Some(rustix::io::Errno::PERM.raw_os_error()));
    let reopened = File::options().read(true).write(true).open(&path).unwrap();
    // SAFETY: if this succeeds, the mapping is never touched.
    let mapped = unsafe { memmap2::MmapOptions::new().len(4096).map_mut(&reopened) };
    assert_eq!(mapped.unwrap_err().raw_os_error(), Some(rustix::io::Errno::PERM.raw_os_error()));
    // Not executable, or, before Linux 6.3, executable and no program.
    assert!(std::process::Command::new(&path).spawn().is_err());
    // It may close the file to itself by name; descriptors that are handed over are not asked for permission.
    file.set_permissions(std::fs::Permissions::from_mode(0o000)).unwrap();
    rustix::fs::flock(&file, rustix::fs::FlockOperation::NonBlockingLockExclusive).unwrap();
    memory.write_frame(&crate::common::frame(1));
    memory.ring(1, None);
    let next = DriverView::map(memory.fd()).unwrap();
    let mut found = crate::common::frame(9);
    next.read_frame(1, &mut found).unwrap();
    assert!(crate::common::is_frame(&found, 1));
}

#[test]
fn more_devices_than_a_frame_has_room_for_are_an_error_that_names_the_limit() {
    let error = DriverMemory::create(&info_of(shm_abi::MAX_DEVICES + 1)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "there are 9 devices, and a driver can have 8 at most; start a second driver"
    );
}

#[test]
fn views_of_one_driver_s_memory_are_told_from_those_of_another_s() {
    let [one, other] = [(), ()].map(|()| DriverMemory::create(&info()).unwrap());
    let view = |of: &DriverMemory| DriverView::map(of.fd()).unwrap();
    assert!(view(&one).is_same_driver(&view(&one)));
    assert!(!view(&one).is_same_driver(&view(&other)));
}
