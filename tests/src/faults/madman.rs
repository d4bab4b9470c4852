//! A commander gone mad: whole commands, forged ones, and any words anywhere in its memory.

use crate::faults::random::Random;
use shm_abi::seqlock::stamp;
use shm_abi::{Command, CommanderMemory, CommanderSegment, DriverView};
use std::sync::atomic::{AtomicU64, Ordering};

/// Bits that a careless reader trips over.
fn word(random: &mut Random, tick: u64, lease: u64) -> u64 {
    let small = random.below(4);
    match random.below(16) {
        0 => f64::NAN.to_bits(),
        1 => f64::INFINITY.to_bits(),
        2 => f64::NEG_INFINITY.to_bits(),
        3 => f64::MAX.to_bits(),
        4 => (-1e308f64).to_bits(),
        5 => (-0.0f64).to_bits(),
        6 => 1, // the smallest number there is
        7 => 0,
        8 => u64::MAX - small,
        9 => tick.wrapping_add(small).wrapping_sub(2),
        10 => stamp(tick).wrapping_add(small).wrapping_sub(2),
        11 => lease.wrapping_add(small).wrapping_sub(1),
        12 => random.unit().to_bits(),
        13 => (random.unit() * 1e3).to_bits(),
        _ => random.word(),
    }
}

/// Mostly forces that a finger could feel, sometimes some that no device can render.
fn force(random: &mut Random) -> [f64; 3] {
    let size = [1.0, 20.0, 1e9, 1e308][usize::try_from(random.below(4)).expect("small")];
    std::array::from_fn(|_| random.unit() * size)
}

fn honest_command(random: &mut Random, tick: u64, lease: u64, devices: usize) -> Command {
    let mut command = Command::zero(tick, lease, devices as u64);
    for device in &mut command.devices[..devices] {
        device.force_on_user_n = force(random);
    }
    command
}

/// A command that is right but for some words, and lies in a slot that is right but perhaps for its sequence.
fn forge(random: &mut Random, to: &CommanderSegment, tick: u64, lease: u64, devices: usize) {
    let command = honest_command(random, tick, lease, devices);
    let mut words: Vec<u64> = bytemuck::cast_slice::<Command, u64>(&[command]).to_vec();
    for _ in 0..random.below(3) {
        let at = random.below(words.len() as u64) as usize;
        // Among the first words are the tick, the lease, the count and the first device's force.
        let at = if random.once_in(2) { at % 8 } else { at };
        words[at] = word(random, tick, lease);
    }
    let slot = &to.commands[tick as usize % to.commands.len()];
    for (word, value) in slot.words.iter().zip(words) {
        word.store(value, Ordering::Relaxed);
    }
    let sequence = if random.once_in(4) { word(random, tick, lease) } else { stamp(tick) };
    slot.sequence.store(sequence, Ordering::Release);
    let rung = if random.once_in(8) { word(random, tick, lease) } else { tick + 1 };
    to.bell.latest_plus_one.store(rung, Ordering::Release);
    to.bell.doorbell.store(rung as u32, Ordering::Release);
}

/// Any words anywhere, the head and the bell included.
fn scribble(random: &mut Random, to: &CommanderSegment, tick: u64, lease: u64) {
    for _ in 0..=random.below(20) {
        let value = word(random, tick, lease);
        let slot = &to.commands[random.below(4) as usize];
        let place: &AtomicU64 = match random.below(32) {
            0 => &to.bell.latest_plus_one,
            1 => &to.bell.owner_sleeps,
            2 => &to.bell.reserved[random.below(5) as usize],
            3 => &to.header.magic,
            4 => &to.header.lease,
            5 => &to.header.abi_version,
            6..10 => &slot.sequence,
            _ => &slot.words[random.below(slot.words.len() as u64) as usize],
        };
        place.store(value, Ordering::Relaxed);
        to.bell.doorbell.store(random.word() as u32, Ordering::Relaxed);
    }
}

/// One thing that a commander gone mad may do.
pub fn rave(
    random: &mut Random,
    to: &CommanderMemory,
    driver: &DriverView,
    tick: u64,
    lease: u64,
    devices: usize,
) {
    match random.below(8) {
        0 => {}
        1 | 2 => to.publish(&honest_command(random, tick, lease, devices), driver),
        3 => {
            let other = tick.wrapping_add(random.below(8)).saturating_sub(6);
            to.publish(&honest_command(random, other, lease, devices), driver);
        }
        4 | 5 => forge(random, to, tick, lease, devices),
        _ => scribble(random, to, tick, lease),
    }
}
