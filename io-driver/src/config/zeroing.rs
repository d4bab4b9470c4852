//! `zeroing`: how a device learns where it is.

use serde::Deserialize;

/// When an arm's pose is taken for its zeroing pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Zeroing {
    /// When it is read first: somebody sees to it that it is in that pose whenever a driver starts.
    #[default]
    AtStart,
    /// When a person says so (`io-driver zero`). Until then it knows only how far it moved, and gets no force.
    Ask,
    /// Never: its counters read zero in that pose, as those of absolute encoders do, and of simulated arms.
    Known,
}

impl Zeroing {
    /// The word in the configuration.
    pub fn name(self) -> &'static str {
        match self {
            Self::AtStart => "at-start",
            Self::Ask => "ask",
            Self::Known => "known",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::DriverConfig;
    use std::path::Path;

    const REPLAY: &str = "backend = \"replay\"\ndescription = \"premium-1.5\"\ntrace = \"t.csv\"\n";
    const EMULATED: &str = "backend = \"emulated\"\ndescription = \"premium-1.5\"\ncard = \"card\"\n";

    fn parse(device: &str) -> Result<DriverConfig, String> {
        let text = format!("[[device]]\n{device}");
        DriverConfig::parse(&text, Path::new("driver.toml")).map_err(|error| error.to_string())
    }

    fn zeroing(device: &str) -> Zeroing {
        parse(device).unwrap().devices[0].zeroing
    }

    #[test]
    fn a_trace_begins_at_home_and_any_other_arm_asks_unless_somebody_says_otherwise() {
        assert_eq!(zeroing(REPLAY), Zeroing::AtStart);
        assert_eq!(zeroing(EMULATED), Zeroing::Ask);
        let simulated = "backend = \"simulated\"\ndescription = \"premium-1.5\"\n";
        assert_eq!(zeroing(simulated), Zeroing::Known);
        assert_eq!(zeroing(&format!("{REPLAY}zeroing = \"ask\"\n")), Zeroing::Ask);
        assert_eq!(zeroing(&format!("{EMULATED}zeroing = \"at-start\"\n")), Zeroing::AtStart);
    }

    #[test]
    fn it_survives_being_written_down() {
        for zeroing in ["ask", "at-start", "known"] {
            for device in [REPLAY, EMULATED] {
                let config = parse(&format!("{device}zeroing = \"{zeroing}\"\n")).unwrap();
                let again = DriverConfig::parse(&config.to_toml(), Path::new("again.toml")).unwrap();
                assert_eq!(again.devices[0].zeroing, config.devices[0].zeroing);
            }
        }
    }

    #[test]
    fn a_word_that_means_nothing_and_a_device_without_counters_are_refused() {
        let word = parse(&format!("{EMULATED}zeroing = \"later\"\n")).unwrap_err();
        assert!(word.contains("at-start") && word.contains("ask"), "{word}");
        let ideal = parse("backend = \"ideal\"\nzeroing = \"ask\"\n").unwrap_err();
        assert!(ideal.contains("`zeroing` in a device of backend \"ideal\""), "{ideal}");
    }
}
