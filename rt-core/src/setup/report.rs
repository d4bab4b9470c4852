//! What was wanted, what was found, what to do about the difference.

use std::fmt;

/// One item of a set-up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guarantee {
    /// What it is about, for instance `memory locked`.
    pub name: &'static str,
    /// What was asked for.
    pub wanted: String,
    /// What the kernel says is in force.
    pub found: String,
    /// Whether that is enough.
    pub obtained: bool,
    /// What an operator can do; none if it was obtained.
    pub remedy: Option<String>,
    /// Not something this process asked for, but a circumstance that decides what its guarantees
    /// are worth: the kind of kernel, the isolation of the CPU, the throttling of real-time threads.
    pub circumstance: bool,
}

impl Guarantee {
    /// One that the process asked for. The remedy is dropped if there is nothing to remedy.
    pub(crate) fn asked(name: &'static str, wanted: String, found: String, remedy: Option<String>) -> Self {
        Self { name, wanted, found, obtained: remedy.is_none(), remedy, circumstance: false }
    }

    /// One that the machine's owner decides.
    #[must_use]
    pub fn circumstance(name: &'static str, wanted: &str, found: String, remedy: Option<String>) -> Self {
        let asked = Self::asked(name, wanted.to_owned(), found, remedy);
        Self { circumstance: true, ..asked }
    }
}

impl fmt::Display for Guarantee {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.obtained {
            return write!(f, "  obtained  {}: {}", self.name, self.found);
        }
        write!(f, "  MISSING   {}: wanted {}, found {}", self.name, self.wanted, self.found)?;
        self.remedy.iter().try_for_each(|remedy| write!(f, "; remedy: {remedy}"))
    }
}

/// All items of a set-up, in the order in which they were tried.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SetupReport {
    /// The items.
    pub guarantees: Vec<Guarantee>,
}

impl SetupReport {
    /// Whether nothing is missing, circumstances included.
    #[must_use]
    pub fn all_obtained(&self) -> bool {
        self.missing().next().is_none()
    }

    /// Whether the process got all it asked for, whatever the circumstances.
    #[must_use]
    pub fn all_requests_obtained(&self) -> bool {
        self.missing().all(|guarantee| guarantee.circumstance)
    }

    /// What is missing.
    pub fn missing(&self) -> impl Iterator<Item = &Guarantee> {
        self.guarantees.iter().filter(|guarantee| !guarantee.obtained)
    }

    /// The item of that name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<&Guarantee> {
        self.guarantees.iter().find(|guarantee| guarantee.name == name)
    }
}

impl fmt::Display for SetupReport {
    /// One line for each item.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.guarantees.iter().try_for_each(|guarantee| writeln!(f, "{guarantee}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> SetupReport {
        let fifo = "SCHED_FIFO 80".to_owned();
        let locked = ("all pages".to_owned(), "0 KiB".to_owned(), Some("raise the limit".to_owned()));
        SetupReport {
            guarantees: vec![
                Guarantee::asked("scheduling", fifo.clone(), fifo, None),
                Guarantee::asked("memory locked", locked.0, locked.1, locked.2),
            ],
        }
    }

    #[test]
    fn every_item_is_one_clear_line() {
        assert_eq!(
            report().to_string(),
            "  obtained  scheduling: SCHED_FIFO 80\n  \
             MISSING   memory locked: wanted all pages, found 0 KiB; remedy: raise the limit\n"
        );
    }

    #[test]
    fn one_missing_item_spoils_the_whole() {
        let mut report = report();
        assert!(!report.all_obtained() && !report.all_requests_obtained());
        assert_eq!(report.missing().map(|g| g.name).collect::<Vec<_>>(), ["memory locked"]);
        report.guarantees.pop();
        assert!(report.all_obtained());
        assert!(SetupReport::default().all_obtained(), "nothing asked, nothing missing");
    }

    #[test]
    fn a_missing_circumstance_does_not_spoil_the_requests() {
        let mut report = report();
        report.guarantees[1].circumstance = true;
        assert!(report.all_requests_obtained() && !report.all_obtained());
    }
}
