//! The driver's segment: written by the driver, read by everybody else.

use super::commander::wake;
use super::description::{describe, device_count};
use super::mapping::{Mapping, check, close_to_others, create_memfd, keep_apart, seal};
use super::text::{lines_of, put_text};
use super::{
    ClockMode, CommanderMemory, CommanderView, DeviceInfo, DriverInfo, SegmentError, bounds, expect,
    expect_compatible, get, slot_of, words_of, words_of_mut,
};
use crate::doorbell::{self, Place, WaitMode};
use crate::frame::{DeviceFrame, Frame};
use crate::handshake;
use crate::layout::{
    DRIVER_COMMISSIONING, DriverSegment, LAYOUT_HASH, MAGIC, MAX_DEVICES, RING_FRAMES, SLEEPS_ON_OWN_WORD,
};
use crate::seqlock::{self, Torn};
use bytemuck::Zeroable;
use rustix::fs::SealFlags;
use std::ops::Deref;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::time::Duration;
use thiserror::Error;

/// Why a frame could not be had.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum FrameUnavailable {
    /// Its tick has not come.
    #[error("frame {0} is not published yet")]
    NotYet(u64),
    /// The ring has gone round.
    #[error("frame {0} has been overwritten")]
    Overwritten(u64),
    /// It was being overwritten.
    #[error("frame {0} was torn")]
    Torn(u64),
}

/// The driver's segment, in the driver.
#[derive(Debug)]
pub struct DriverMemory {
    pub(super) map: Mapping<DriverSegment>,
    fd: OwnedFd,
    /// Keeps its pages from being merged.
    _pages: OwnedFd,
    /// How much of a frame is written.
    frame_words: usize,
}

impl DriverMemory {
    /// Creates, fills in and seals it.
    pub fn create(info: &DriverInfo) -> Result<Self, SegmentError> {
        if info.devices.len() > MAX_DEVICES {
            return Err(SegmentError::TooManyDevices { found: info.devices.len() });
        }
        let fd = create_memfd(c"phantom3-driver", size_of::<DriverSegment>())?;
        close_to_others(&fd)?;
        let map = Mapping::<DriverSegment>::writable(&fd)?;
        describe(&map, info);
        // After our own mapping stands, nobody gets another writable one.
        seal(&fd, SealFlags::SHRINK | SealFlags::GROW | SealFlags::FUTURE_WRITE | SealFlags::SEAL)?;
        let pages = keep_apart(&fd, size_of::<DriverSegment>())?;
        Ok(Self { map, fd, _pages: pages, frame_words: frame_words(info.devices.len()) })
    }

    /// Replaces the set-up report. Only before the segment is handed over for the first time: a reader takes
    /// the text as it stands.
    pub fn tell_setup_report(&self, report: &str) {
        put_text(&self.map.setup_report, report);
    }

    /// Writes frame `k`. Call [`ring`](Self::ring) next. Devices beyond those of the description are not
    /// written: their words stay zero for as long as the memory lives, so that a reader may as well read all.
    #[inline]
    pub fn write_frame(&self, frame: &Frame) {
        let slot = &self.map.frames[slot_of(frame.tick, RING_FRAMES)];
        let used = self.frame_words;
        seqlock::write(&slot.sequence, &slot.words[..used], &words_of(frame)[..used], frame.tick);
    }

    /// Announces frame `tick` and wakes the commander if it sleeps. Returns how many sleepers were woken. For whoever has no
    /// deadlines; see [`tell_frame`](Self::tell_frame).
    #[inline]
    pub fn ring(&self, tick: u64, commander: Option<&CommanderView>) -> usize {
        let sleeps = self.tell_frame(tick, commander);
        commander.filter(|_| sleeps).map_or(0, |view| wake(&view.map, self))
    }

    /// Announces frame `tick` and wakes nobody; says whether the commander sleeps. Fit for the loop.
    #[inline]
    pub fn tell_frame(&self, tick: u64, commander: Option<&CommanderView>) -> bool {
        let bell = &self.map.bell;
        match commander {
            Some(view) => {
                doorbell::tell_frame(bell, tick, &view.map.bell.owner_sleeps, &view.map.header.frame_doorbell)
            }
            None => {
                doorbell::tell(bell, tick);
                false
            }
        }
    }

    /// Reads the newest frame, as [`DriverView::read_latest`] does.
    pub fn read_latest(&self) -> Option<Frame> {
        read_latest(&self.map, self.frame_words)
    }

    /// The descriptor to hand over.
    pub fn fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }
}

impl Deref for DriverMemory {
    type Target = DriverSegment;
    fn deref(&self) -> &DriverSegment {
        &self.map
    }
}

/// Reads the first words of frame `tick`; the others are zero.
#[inline]
fn read_frame(
    segment: &DriverSegment,
    frame_words: usize,
    tick: u64,
    frame: &mut Frame,
) -> Result<(), FrameUnavailable> {
    let slot = &segment.frames[slot_of(tick, RING_FRAMES)];
    let (used, beyond) = words_of_mut(frame).split_at_mut(frame_words);
    beyond.fill(0);
    let stamp = seqlock::read(&slot.sequence, &slot.words[..used.len()], used)
        .map_err(|Torn| FrameUnavailable::Torn(tick))?;
    match stamp.cmp(&seqlock::stamp(tick)) {
        std::cmp::Ordering::Equal => Ok(()),
        std::cmp::Ordering::Less => Err(FrameUnavailable::NotYet(tick)),
        std::cmp::Ordering::Greater => Err(FrameUnavailable::Overwritten(tick)),
    }
}

/// The newest frame. `None`: there is none, or a few tries in a row were overtaken.
fn read_latest(segment: &DriverSegment, frame_words: usize) -> Option<Frame> {
    const TRIES: usize = 8;
    let mut frame = Frame::zeroed();
    for _ in 0..TRIES {
        let tick = doorbell::latest(&segment.bell).filter(|tick| *tick <= LAST_TICK)?;
        if read_frame(segment, frame_words, tick, &mut frame).is_ok() {
            return Some(frame);
        }
    }
    None
}

/// The driver's segment, everywhere else: read-only.
#[derive(Debug)]
pub struct DriverView {
    pub(super) map: Mapping<DriverSegment>,
    /// How much of a frame is read.
    frame_words: usize,
    /// Of the memory: device and number of its file.
    file: [u64; 2],
}

impl DriverView {
    /// Maps a descriptor that was handed over, after checking seals, size and header.
    pub fn map(fd: BorrowedFd<'_>) -> Result<Self, SegmentError> {
        check(fd, size_of::<DriverSegment>(), SealFlags::SHRINK | SealFlags::GROW)?;
        let map = Mapping::<DriverSegment>::read_only(&fd)?;
        let header = &map.header;
        expect("magic", &header.magic, MAGIC)?;
        expect_compatible(&header.abi_version)?;
        expect("layout hash", &header.layout_hash, LAYOUT_HASH)?;
        expect("ready word", &header.ready, 1)?;
        bounds::check(header)?;
        let frame_words = frame_words(device_count(&map));
        let found = rustix::fs::fstat(fd)
            .map_err(|errno| SegmentError::System { what: "identify", source: errno.into() })?;
        Ok(Self { map, frame_words, file: [found.st_dev, found.st_ino] })
    }

    /// True for the memory of the same driver, and not of one that was started after it.
    pub fn is_same_driver(&self, other: &Self) -> bool {
        self.file == other.file
    }

    /// The driver's minor version. What later ones than this added reads as zero.
    pub fn abi_minor(&self) -> u32 {
        // The major half was checked when the memory was mapped.
        handshake::minor_of(get(&self.map.header.abi_version))
    }

    /// Over how many ticks the driver lets forces come on; of [`Self::info`], without the heap.
    pub fn ramp_in_ticks(&self) -> u64 {
        get(&self.map.header.ramp_in_ticks)
    }

    /// What the driver says of itself. Values that became impossible since the memory was mapped are replaced by
    /// harmless ones.
    pub fn info(&self) -> DriverInfo {
        let header = &self.map.header;
        DriverInfo {
            period_ns: get(&header.period_ns).clamp(*bounds::PERIOD_NS.start(), *bounds::PERIOD_NS.end()),
            reply_budget_ns: get(&header.reply_budget_ns),
            max_command_age_ticks: get(&header.max_command_age_ticks),
            ramp_in_ticks: get(&header.ramp_in_ticks),
            ramp_out_ticks: get(&header.ramp_out_ticks),
            clock_mode: ClockMode::from_word(get(&header.clock_mode)).unwrap_or(ClockMode::Real),
            is_commissioning: get(&header.flags) & DRIVER_COMMISSIONING != 0,
            wait_mode: WaitMode::from_word(get(&header.wait_mode)).unwrap_or(WaitMode::Futex),
            cpu: get(&header.cpu_plus_one).checked_sub(1).and_then(|cpu| usize::try_from(cpu).ok()),
            devices: self.map.devices[..device_count(&self.map)]
                .iter()
                .map(DeviceInfo::from_description)
                .collect(),
            setup_report: lines_of(&self.map.setup_report),
        }
    }

    /// The tick of the newest frame.
    #[inline]
    pub fn latest_tick(&self) -> Option<u64> {
        doorbell::latest(&self.map.bell)
    }

    /// Reads frame `tick` whole into `frame`, or says why it cannot be had; `frame` is of no use then. Devices
    /// beyond those that the driver described are zero, whatever stood in `frame`.
    #[inline]
    pub fn read_frame(&self, tick: u64, frame: &mut Frame) -> Result<(), FrameUnavailable> {
        if tick > LAST_TICK {
            return Err(FrameUnavailable::NotYet(tick));
        }
        read_frame(&self.map, self.frame_words, tick, frame)
    }

    /// Reads the newest frame. `None`: there is none, or a few tries in a row were overtaken.
    pub fn read_latest(&self) -> Option<Frame> {
        read_latest(&self.map, self.frame_words)
    }

    /// Sleeps until there is a newer frame than `seen`, or `timeout` passes, or a signal comes. The driver
    /// wakes only the commander, whose memory is passed here; observers sleep by the clock.
    pub fn sleep_for_frame(&self, seen: Option<u64>, own: &CommanderMemory, timeout: Duration) {
        let own = &own.map;
        let place = if self.abi_minor() >= FIRST_WITH_OWN_WORD {
            Place { word: &own.header.frame_doorbell, flag: SLEEPS_ON_OWN_WORD }
        } else {
            Place::bell(&self.map.bell)
        };
        doorbell::sleep(place, &self.map.bell, seen, &own.bell.owner_sleeps, timeout);
    }
}

impl Deref for DriverView {
    type Target = DriverSegment;
    /// The segment; it is mapped read-only, so a store through one of its atomics ends in SIGSEGV.
    fn deref(&self) -> &DriverSegment {
        &self.map
    }
}

/// The first minor version whose drivers ring the commander's own word.
const FIRST_WITH_OWN_WORD: u32 = 3;

/// The stamps of later ticks would be those of early ones again (after 292 million years at 1 kHz, so that
/// only an allegation names one).
const LAST_TICK: u64 = (u64::MAX >> 1) - 1;

/// The words of a frame that mean something where so many devices exist: they come last in it.
const fn frame_words(devices: usize) -> usize {
    (std::mem::offset_of!(Frame, devices) + devices * size_of::<DeviceFrame>()) / size_of::<u64>()
}

#[cfg(test)]
mod tests {
    use super::LAST_TICK;
    use crate::seqlock::stamp;

    #[test]
    fn the_last_tick_is_the_last_whose_stamp_no_other_has() {
        assert_eq!(stamp(LAST_TICK), u64::MAX - 1);
        // That of a place where nothing was ever written.
        assert_eq!(stamp(LAST_TICK + 1), 0);
    }
}
