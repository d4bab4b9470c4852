//! What happens in one run of the campaign: drawn from a seed, and from nothing else.

use crate::faults::random::Random;
use std::fmt;

/// One thing that goes wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Strike {
    /// The application is killed.
    KillApp,
    /// It is killed so long after it was started (us).
    KillAppStarting(u64),
    /// It is asked to end and killed so long afterwards (us).
    KillAppEnding(u64),
    /// It stands still so long (ms).
    StopApp(u64),
    /// It stands still, so long after it was started (us).
    StopAppStarting(u64),
    /// It is asked to end, and stands still so long afterwards (us).
    StopAppEnding(u64),
    /// Another copy of it, in another place, takes over.
    UpgradeApp,
    /// A second one wants the lease.
    SecondApp,
    /// A program of another ABI, or of none, knocks.
    ForeignApp,
    /// More clients than the driver takes.
    Crowd,
    /// A commander writes garbage for so long (ms).
    Madman(u64),
    /// One whose lease has ended goes on writing.
    FormerHolder,
    /// The driver is killed.
    KillDriver,
    /// It is killed so long after it was started (us).
    KillDriverStarting(u64),
    /// It is asked to stop and killed so long afterwards (us).
    KillDriverEnding(u64),
    /// It stands still so long (ms).
    StopDriver(u64),
    /// It stands still, so long after it was started (us).
    StopDriverStarting(u64),
    /// It is asked to stop, and stands still so long afterwards (us).
    StopDriverEnding(u64),
    /// It is asked to stop.
    EndDriver,
    /// It is asked by the same signal twice, so long apart (us), which ends it at once.
    EndDriverTwice(u64),
    /// It gets a fatal signal.
    Signal(i32),
    /// Something goes wrong inside its loop; a button's number tells what, see [`SABOTAGES`].
    Sabotage(u32),
    /// A second driver wants the card and the socket.
    SecondDriver,
    /// It has no descriptors left for a while.
    NoDescriptors,
    /// Somebody presses the emergency stop.
    EmergencyStop,
    /// A thread of higher priority takes its CPU for so long (ms).
    Hog(u64),
    /// The emulator stands still so long (ms).
    StopEmulator(u64),
    /// It is killed.
    KillEmulator,
}

/// What each button does to the driver's loop, from button 8 on.
pub const SABOTAGES: [&str; 12] = [
    "panic",
    "panic-before-write",
    "panic-after-write",
    "overflow",
    "segv",
    "abort",
    "forbidden-call",
    "nan",
    "leap",
    "unreadable",
    "unwritable",
    "hang:40",
];
/// The first button of [`SABOTAGES`].
pub const FIRST_BUTTON: u32 = 8;

/// What follows a strike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Then {
    /// Everything is brought back to the whole force.
    Heal,
    /// The next strike, so long afterwards (us); what was stopped stays so.
    Next(u64),
}

/// One run.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// What it was drawn from.
    pub seed: u64,
    /// Longest force (N).
    pub peak_n: f64,
    /// How fast a force may grow (N/s).
    pub slew_n_per_s: f64,
    /// So long after the whole force is there (us) a strike comes, and what follows it.
    pub strikes: Vec<(u64, Strike, Then)>,
}

impl Plan {
    /// The plan of a seed.
    pub fn of(seed: u64) -> Self {
        let mut random = Random::new(seed);
        // Far below what the motors give, and about as much; full force in 40 values and in 4.
        let peak_n = if random.once_in(2) { 3.0 } else { 8.5 };
        let slew_n_per_s = if random.once_in(2) { 400.0 } else { 4000.0 };
        let strikes = (0..1 + random.below(4))
            .map(|_| {
                let delay_us = random.below(6000);
                let strike = Strike::draw(&mut random);
                let then = if random.once_in(3) { Then::Next(random.below(4000)) } else { Then::Heal };
                (delay_us, strike, then)
            })
            .collect();
        Self { seed, peak_n, slew_n_per_s, strikes }
    }

    /// The sabotage that the driver has to be prepared for: everything, by its button.
    pub fn sabotage(&self) -> String {
        let item = |(index, act): (usize, &&str)| format!("{act}@button{}", FIRST_BUTTON + index as u32);
        SABOTAGES.iter().enumerate().map(item).collect::<Vec<_>>().join(",")
    }
}

impl Strike {
    fn draw(random: &mut Random) -> Self {
        let us = |random: &mut Random| random.below(25_000);
        match random.below(31) {
            0 | 1 => Self::KillApp,
            2 => Self::KillAppStarting(us(random)),
            3 => Self::KillAppEnding(us(random) / 5),
            4 => Self::StopApp(1 + random.below(60)),
            5 => Self::UpgradeApp,
            6 => Self::SecondApp,
            7 => Self::ForeignApp,
            8 => Self::Crowd,
            9 | 10 => Self::Madman(20 + random.below(150)),
            11 => Self::FormerHolder,
            12 | 13 => Self::KillDriver,
            14 => Self::KillDriverStarting(us(random)),
            15 => Self::KillDriverEnding(us(random)),
            16 => Self::StopDriver(1 + random.below(300)),
            17 => Self::EndDriver,
            18 => Self::EndDriverTwice(us(random)),
            19 => Self::Signal([4, 6, 7, 8, 11][random.below(5) as usize]),
            20 | 21 => Self::Sabotage(FIRST_BUTTON + random.below(SABOTAGES.len() as u64) as u32),
            22 => Self::SecondDriver,
            23 => Self::NoDescriptors,
            24 => Self::EmergencyStop,
            25 if random.once_in(3) => Self::Hog(50 + random.below(250)),
            25 => Self::StopEmulator(1 + random.below(300)),
            26 => Self::StopAppStarting(us(random)),
            27 => Self::StopAppEnding(us(random) / 5),
            28 => Self::StopDriverStarting(us(random)),
            29 => Self::StopDriverEnding(us(random)),
            _ => Self::KillEmulator,
        }
    }

    /// One of each kind.
    pub fn each() -> Vec<Self> {
        let mut each = vec![
            Self::KillApp,
            Self::KillAppStarting(5000),
            Self::KillAppEnding(500),
            Self::StopApp(60),
            Self::StopAppStarting(5000),
            Self::StopAppEnding(500),
            Self::UpgradeApp,
            Self::SecondApp,
            Self::ForeignApp,
            Self::Crowd,
            Self::Madman(150),
            Self::FormerHolder,
            Self::KillDriver,
            Self::KillDriverStarting(5000),
            Self::KillDriverEnding(1000),
            Self::StopDriver(300),
            Self::StopDriverStarting(5000),
            Self::StopDriverEnding(1000),
            Self::EndDriver,
            Self::EndDriverTwice(1000),
            Self::SecondDriver,
            Self::NoDescriptors,
            Self::EmergencyStop,
            Self::Hog(300),
            Self::StopEmulator(300),
            Self::KillEmulator,
        ];
        each.extend([4, 6, 7, 8, 11].map(Self::Signal));
        each.extend((0..SABOTAGES.len() as u32).map(|index| Self::Sabotage(FIRST_BUTTON + index)));
        each
    }

    /// Its kind, for a table.
    pub fn name(&self) -> &'static str {
        match self {
            Self::KillApp => "app killed",
            Self::KillAppStarting(_) => "app killed starting",
            Self::KillAppEnding(_) => "app killed ending",
            Self::StopApp(_) => "app stopped",
            Self::StopAppStarting(_) => "app stopped starting",
            Self::StopAppEnding(_) => "app stopped ending",
            Self::UpgradeApp => "app upgraded",
            Self::SecondApp => "second app",
            Self::ForeignApp => "foreign app",
            Self::Crowd => "crowd",
            Self::Madman(_) => "garbage",
            Self::FormerHolder => "former holder",
            Self::KillDriver => "driver killed",
            Self::KillDriverStarting(_) => "driver killed starting",
            Self::KillDriverEnding(_) => "driver killed ending",
            Self::StopDriver(_) => "driver stopped",
            Self::StopDriverStarting(_) => "driver stopped starting",
            Self::StopDriverEnding(_) => "driver stopped ending",
            Self::EndDriver => "driver ended",
            Self::EndDriverTwice(_) => "driver ended twice",
            Self::Signal(_) => "driver signalled",
            Self::Sabotage(button) => {
                SABOTAGES.get((button - FIRST_BUTTON) as usize).copied().unwrap_or("sabotage")
            }
            Self::SecondDriver => "second driver",
            Self::NoDescriptors => "no descriptors",
            Self::EmergencyStop => "emergency stop",
            Self::Hog(_) => "hog",
            Self::StopEmulator(_) => "emulator stopped",
            Self::KillEmulator => "emulator killed",
        }
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seed, peak_n, slew_n_per_s, strikes } = self;
        write!(f, "0x{seed:016x}: {peak_n} N, {slew_n_per_s} N/s")?;
        strikes.iter().try_for_each(|(delay, strike, then)| write!(f, "; {delay} us {strike:?} {then:?}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_comes_from_its_seed_alone() {
        assert_eq!(Plan::of(7), Plan::of(7));
        assert_ne!(Plan::of(7), Plan::of(8));
    }

    #[test]
    fn every_kind_of_strike_is_drawn() {
        let names: std::collections::BTreeSet<_> =
            (0..3000).flat_map(|seed| Plan::of(seed).strikes).map(|(_, strike, _)| strike.name()).collect();
        assert_eq!(names.len(), 27 + SABOTAGES.len(), "{names:?}");
    }
}
