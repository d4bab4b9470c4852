//! One thing to do, as data: the fix plan sorts, merges and writes them.

/// One step with its reason.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Step {
    /// What it does, in a few words.
    pub what: String,
    /// How.
    pub action: Action,
}

/// How a step is done.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Action {
    /// Something that no script should do by itself.
    ByHand,
    /// `key=value` on the kernel's command line.
    Boot {
        /// The key.
        key: &'static str,
        /// The value; empty for a bare word.
        value: String,
        /// What the running kernel was given for the key.
        former: Option<String>,
    },
    /// A kernel parameter under `/proc/sys`.
    Sysctl {
        /// With dots.
        key: &'static str,
        /// What it should be.
        value: String,
        /// What it is.
        former: String,
    },
    /// A value for a file under `/sys` or `/proc`.
    Put {
        /// The file.
        path: String,
        /// What it should say.
        value: String,
        /// What it says.
        former: String,
        /// Whether the name means the same after the next boot; interrupt numbers do not.
        lasting: bool,
    },
    /// A service that should not run.
    Stop {
        /// Its systemd unit.
        unit: &'static str,
    },
    /// Swap areas should be off.
    SwapOff,
    /// The user's limits: real-time priority and locked memory.
    Limits,
    /// A rule for udev.
    Udev {
        /// The rule.
        rule: String,
    },
    /// A module of the kernel that has to be there.
    Module {
        /// Its name.
        name: &'static str,
    },
    /// A PCI device that its kernel driver should leave alone.
    Unbind {
        /// Its address.
        address: String,
        /// The driver.
        driver: String,
    },
    /// A runtime directory with its permissions.
    Directory {
        /// Where.
        path: String,
        /// Permission bits.
        mode: u32,
    },
}

impl Step {
    /// What has to be done by hand.
    pub fn by_hand(what: impl Into<String>) -> Self {
        Self { what: what.into(), action: Action::ByHand }
    }

    /// A sysctl.
    pub fn sysctl(what: &str, key: &'static str, value: i64, former: i64) -> Self {
        let (value, former) = (value.to_string(), former.to_string());
        Self { what: what.into(), action: Action::Sysctl { key, value, former } }
    }

    /// A value for a file whose name stays.
    pub fn put(
        what: &str,
        path: impl Into<String>,
        value: impl Into<String>,
        former: impl Into<String>,
    ) -> Self {
        let (path, value, former) = (path.into(), value.into(), former.into());
        Self { what: what.into(), action: Action::Put { path, value, former, lasting: true } }
    }

    /// A word for the kernel's command line.
    pub fn boot(what: &str, key: &'static str, value: impl Into<String>, former: Option<String>) -> Self {
        Self { what: what.into(), action: Action::Boot { key, value: value.into(), former } }
    }

    /// A udev rule.
    pub fn udev(what: &str, rule: impl Into<String>) -> Self {
        Self { what: what.into(), action: Action::Udev { rule: rule.into() } }
    }
}
