//! Is this machine ready for a hard real-time loop? Every circumstance that is known to spoil one.
//!
//! Problem: a loop misses its deadlines for reasons outside its program: a frequency governor, an
//! interrupt, a cgroup without real-time share, a promotion that silently did nothing. Each is found
//! once, painfully; here they are all looked for in a second, with what to do about each.
//! Model: a [`Check`] is a pure function of a [`Machine`], which is a tree of files (the real one or a
//! recorded one) and a few [`probe::Probes`] that try something live (or tell a recorded outcome). It
//! gives a [`Judgement`]: a verdict, what was found, and a [`Remedy`] in words and as [`step::Step`]s,
//! from which [`plan`] makes a shell script for this machine. [`table`] is for people.
//! Invariants: nothing on the machine is changed; what cannot be read or makes no sense is
//! "unreadable", never "pass"; no content of any file makes a check panic.
//! Cost: some hundred small files, and about a third of a second of probing.
//!
//! | group | file |
//! |---|---|
//! | kernel, starvation, privilege | [`kernel`], [`starvation`], [`privilege`] |
//! | interference, power | [`interference`], [`power`] |
//! | firmware, memory | [`firmware`], [`memory`] |

pub mod cpus;
pub mod firmware;
pub mod interference;
pub mod kernel;
pub mod live;
pub mod machine;
pub mod memory;
pub mod plan;
pub mod power;
pub mod privilege;
pub mod probe;
pub mod recorded;
pub mod starvation;
pub mod step;
pub mod table;

use machine::{Machine, Obstacle};
use step::Step;

/// How a machine does in one respect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// As it should be.
    Pass,
    /// The loop works, and its worst ticks are worse than they need be.
    Warn,
    /// The loop will miss deadlines, or does not get what it needs.
    Fail,
    /// It could not be found out.
    Unreadable,
}

impl Verdict {
    /// The word for it; stable.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Warn => "warn",
            Self::Fail => "fail",
            Self::Unreadable => "unreadable",
        }
    }
}

/// What to do about a finding.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Remedy {
    /// In words, exact: the command, the file, the setting.
    pub text: String,
    /// The same for the fix plan; empty if only a person can do it and the text says all.
    pub steps: Vec<Step>,
}

impl Remedy {
    /// In words alone.
    pub fn words(text: impl Into<String>) -> Self {
        Self { text: text.into(), steps: Vec::new() }
    }

    /// In words and steps.
    pub fn steps(text: impl Into<String>, steps: impl IntoIterator<Item = Step>) -> Self {
        Self { text: text.into(), steps: steps.into_iter().collect() }
    }
}

/// What a check says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// The verdict.
    pub verdict: Verdict,
    /// What was found, in one line.
    pub found: String,
    /// What to do; none with a pass.
    pub remedy: Option<Remedy>,
    /// Which of several like things it is about, for instance a card's address.
    pub subject: Option<String>,
}

impl Judgement {
    /// As it should be.
    pub fn pass(found: impl Into<String>) -> Self {
        Self { verdict: Verdict::Pass, found: found.into(), remedy: None, subject: None }
    }

    /// Worse than it need be.
    pub fn warn(found: impl Into<String>, remedy: Remedy) -> Self {
        Self::bad(Verdict::Warn, found, remedy)
    }

    /// Not good enough.
    pub fn fail(found: impl Into<String>, remedy: Remedy) -> Self {
        Self::bad(Verdict::Fail, found, remedy)
    }

    /// Could not be found out; `remedy` is how it could.
    pub fn unreadable(found: impl Into<String>, remedy: Remedy) -> Self {
        Self::bad(Verdict::Unreadable, found, remedy)
    }

    /// The same about one of several things.
    #[must_use]
    pub fn about(self, subject: impl Into<String>) -> Self {
        Self { subject: Some(subject.into()), ..self }
    }

    fn bad(verdict: Verdict, found: impl Into<String>, remedy: Remedy) -> Self {
        Self { verdict, found: found.into(), remedy: Some(remedy), subject: None }
    }
}

impl From<Obstacle> for Judgement {
    fn from(obstacle: Obstacle) -> Self {
        let remedy = Remedy::words(obstacle.way_round());
        Self::unreadable(obstacle.to_string(), remedy)
    }
}

/// What a check's function returns: an obstacle is judged "unreadable".
pub type Judged = Result<Judgement, Obstacle>;

/// One question about a machine.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// Stable name for programs: `group.question`.
    pub id: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// Why it matters, in one or two sentences.
    pub why: &'static str,
    /// Answers it.
    pub run: fn(&Machine<'_>) -> Judged,
}

/// Questions that belong together.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    /// Its name, which begins the ids of its checks.
    pub name: &'static str,
    /// Its checks, in the order of the output.
    pub checks: &'static [Check],
}

/// All groups of this crate, in the order of the output.
pub const GROUPS: &[Group] = &[
    kernel::GROUP,
    starvation::GROUP,
    privilege::GROUP,
    interference::GROUP,
    power::GROUP,
    firmware::GROUP,
    memory::GROUP,
];

/// A check with what it said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// [`Group::name`].
    pub group: &'static str,
    /// [`Check::id`].
    pub id: &'static str,
    /// [`Check::title`].
    pub title: &'static str,
    /// [`Check::why`].
    pub why: &'static str,
    /// What it said.
    pub judgement: Judgement,
}

impl Finding {
    /// Its verdict.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.judgement.verdict
    }
}

impl Group {
    /// Asks all its questions.
    #[must_use]
    pub fn examine(&self, machine: &Machine<'_>) -> Vec<Finding> {
        self.checks.iter().map(|check| check.examine(self.name, machine)).collect()
    }
}

impl Check {
    /// Asks it.
    #[must_use]
    pub fn examine(&self, group: &'static str, machine: &Machine<'_>) -> Finding {
        self.told(group, (self.run)(machine).unwrap_or_else(Judgement::from))
    }

    /// The finding of a judgement that was made elsewhere.
    #[must_use]
    pub fn told(&self, group: &'static str, judgement: Judgement) -> Finding {
        Finding { group, id: self.id, title: self.title, why: self.why, judgement }
    }
}

/// Asks every question of this crate about a machine.
#[must_use]
pub fn examine(machine: &Machine<'_>) -> Vec<Finding> {
    GROUPS.iter().flat_map(|group| group.examine(machine)).collect()
}

/// How many findings have each verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// As it should be.
    pub pass: usize,
    /// Worse than it need be.
    pub warn: usize,
    /// Not good enough.
    pub fail: usize,
    /// Not found out.
    pub unreadable: usize,
}

impl Tally {
    /// Counts.
    #[must_use]
    pub fn of(findings: &[Finding]) -> Self {
        let count = |verdict| findings.iter().filter(|finding| finding.verdict() == verdict).count();
        Self {
            pass: count(Verdict::Pass),
            warn: count(Verdict::Warn),
            fail: count(Verdict::Fail),
            unreadable: count(Verdict::Unreadable),
        }
    }
}
