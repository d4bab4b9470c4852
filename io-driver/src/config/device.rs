//! `[[device]]`: how each device is reached.

use super::zeroing::Zeroing;
use crate::sim::hand::model_file::{self, Firmness};
use crate::toml_report::{Allowed, SpannedList, TomlReport, TomlText};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use shm_abi::MAX_DEVICES;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// One device.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceConfig {
    /// Its name in reports.
    pub name: String,
    /// How it is reached.
    pub backend: Backend,
    /// Overrides the peak of its description (N).
    pub peak_force_n: Option<f64>,
    /// Overrides how fast its force may grow, turn and reverse (N/s), downwards where a description says it; infinite:
    /// no limit, for an ideal device.
    pub slew_n_per_s: Option<f64>,
    /// Its motors hold up its own weight while somebody commands.
    pub compensates_gravity: bool,
    /// How it learns where it is, if it has counters.
    pub zeroing: Zeroing,
}

/// How a device is reached.
#[derive(Debug, Clone, PartialEq)]
pub enum Backend {
    /// No mechanism: the scripted hand's position goes straight through.
    Ideal(Wish),
    /// A described mechanism, simulated in the driver's process, and a hand that pulls it where the wish says.
    Simulated {
        /// The description: a built-in's name or a file.
        description: PathBuf,
        /// Where the hand wants to be.
        wish: Wish,
        /// Who pulls; `None`: nobody holds the arm.
        holder: Option<HandChoice>,
        /// Of everything random.
        seed: u64,
    },
    /// A recorded encoder trace through a described mechanism.
    Replay {
        /// The description: a built-in's name or a file.
        description: PathBuf,
        /// The trace.
        trace: PathBuf,
        /// R_WD, how its base stands, which its weight minds.
        base_orientation: UnitQuaternion<f64>,
    },
    /// A card of registers that a process of its own emulates, amplifiers with watchdog included.
    Emulated {
        /// The description: a built-in's name or a file.
        description: PathBuf,
        /// The file of registers that both processes map.
        card: PathBuf,
        /// R_WD, how its base stands, which its weight minds.
        base_orientation: UnitQuaternion<f64>,
    },
}

/// Which simulated hand, and how it holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HandChoice {
    /// A built-in hand's name or a file.
    pub model: PathBuf,
    /// How tightly.
    pub firmness: Firmness,
    /// Whether it trembles.
    pub trembles: bool,
}

/// Where a scripted or simulated finger shall be.
#[derive(Debug, Clone, PartialEq)]
pub struct Wish {
    /// Who says.
    pub hand: HandSource,
    /// Where the tip rests without a script, or until a live hand says otherwise, in the world W (m).
    pub start_m: Vector3<f64>,
    /// X_WD, where the base stands.
    pub base_in_world: Isometry3<f64>,
}

/// Who says where a finger shall be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum HandSource {
    /// Nobody: it rests.
    Nobody,
    /// A hand file, and the finger in it.
    Script {
        /// The file.
        file: PathBuf,
        /// Whose columns.
        finger: String,
    },
    /// Whoever moves a live hand: see [`crate::live_hand`].
    Live {
        /// The file that both processes map.
        file: PathBuf,
        /// The finger's number in it.
        finger: usize,
    },
}

impl Backend {
    /// Where its finger shall be, if a script may say so.
    pub fn wish(&self) -> Option<&Wish> {
        match self {
            Self::Ideal(wish) | Self::Simulated { wish, .. } => Some(wish),
            Self::Replay { .. } | Self::Emulated { .. } => None,
        }
    }

    /// The same, to be changed.
    pub fn wish_mut(&mut self) -> Option<&mut Wish> {
        match self {
            Self::Ideal(wish) | Self::Simulated { wish, .. } => Some(wish),
            Self::Replay { .. } | Self::Emulated { .. } => None,
        }
    }

    /// R_WD, how its base stands.
    pub fn base_orientation(&self) -> UnitQuaternion<f64> {
        match self {
            Self::Ideal(wish) | Self::Simulated { wish, .. } => wish.base_in_world.rotation,
            Self::Replay { base_orientation, .. } | Self::Emulated { base_orientation, .. } => {
                *base_orientation
            }
        }
    }

    /// Whether it has registers, behind which motors may be: it knows no time but the real one. Those of an emulated
    /// card stand for a real one's.
    pub fn has_registers(&self) -> bool {
        matches!(self, Self::Emulated { .. })
    }

    /// How many buttons such a device may have; `None`: none, so that no switch could be wired to it.
    /// Whether a hand file has the buttons is seen when it is opened.
    pub(super) fn buttons(&self) -> Option<i64> {
        match self {
            Self::Ideal(Wish { hand: HandSource::Nobody, .. }) | Self::Replay { .. } => None,
            Self::Ideal(_) | Self::Emulated { .. } | Self::Simulated { .. } => Some(32),
        }
    }

    /// A trace begins in the zeroing pose. Those of a simulated arm read zero there. Of an arm whose counters are
    /// alive while drivers come and go, only a person knows.
    fn usual_zeroing(&self) -> Zeroing {
        match self {
            Self::Ideal(_) | Self::Replay { .. } => Zeroing::AtStart,
            Self::Simulated { .. } => Zeroing::Known,
            Self::Emulated { .. } => Zeroing::Ask,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawDevice {
    name: Option<Spanned<String>>,
    backend: Spanned<RawBackend>,
    description: Option<Spanned<PathBuf>>,
    trace: Option<Spanned<PathBuf>>,
    card: Option<Spanned<PathBuf>>,
    gravity_compensation: Option<Spanned<bool>>,
    hand_model: Option<Spanned<PathBuf>>,
    firmness: Option<Spanned<String>>,
    tremor: Option<Spanned<bool>>,
    seed: Option<Spanned<i64>>,
    zeroing: Option<Spanned<Zeroing>>,
    hand: Option<Spanned<PathBuf>>,
    finger: Option<Spanned<String>>,
    live_hand: Option<Spanned<PathBuf>>,
    live_finger: Option<Spanned<i64>>,
    start_m: Option<SpannedList>,
    base_position_m: Option<SpannedList>,
    base_orientation_wxyz: Option<SpannedList>,
    peak_force_n: Option<Spanned<f64>>,
    slew_n_per_s: Option<Spanned<f64>>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "kebab-case")]
enum RawBackend {
    Ideal,
    Simulated,
    Replay,
    Emulated,
}

pub(super) fn devices(
    raw: &Spanned<Vec<Spanned<RawDevice>>>,
    toml: &TomlText<'_>,
    directory: &Path,
) -> Result<Vec<DeviceConfig>, TomlReport> {
    let list = raw.get_ref();
    if list.is_empty() || list.len() > MAX_DEVICES {
        let allowed = format!("1 to {MAX_DEVICES}");
        return Err(toml.refuse(raw.span(), format_args!("{} devices", list.len()), allowed));
    }
    let mut devices: Vec<DeviceConfig> = Vec::with_capacity(list.len());
    for (index, item) in list.iter().enumerate() {
        let device = item.get_ref().validate(index, item.span(), toml, directory)?;
        if devices.iter().any(|other| other.name == device.name) {
            let span = item.get_ref().name.as_ref().map_or(item.span(), Spanned::span);
            return Err(toml.refuse(
                span,
                format_args!("the name \"{}\" twice", device.name),
                "each name once",
            ));
        }
        devices.push(device);
    }
    Ok(devices)
}

impl RawDevice {
    pub(super) fn validate(
        &self,
        index: usize,
        span: std::ops::Range<usize>,
        toml: &TomlText<'_>,
        directory: &Path,
    ) -> Result<DeviceConfig, TomlReport> {
        let name = self.name.as_ref().map_or_else(|| format!("f{index}"), |name| name.get_ref().clone());
        let backend = match self.backend.get_ref() {
            RawBackend::Ideal => self.ideal((&name, index), toml, directory)?,
            RawBackend::Simulated => self.simulated((&name, index), span, toml, directory)?,
            RawBackend::Replay => self.replay(span, toml, directory)?,
            RawBackend::Emulated => self.emulated(span, toml, directory)?,
        };
        let peak_force_n = self.peak_force_n.as_ref().map(|peak| toml.number(peak, PEAK)).transpose()?;
        let slew_n_per_s = self.slew(&backend, toml)?;
        let compensates_gravity = self.gravity_compensation.as_ref().is_some_and(|key| *key.get_ref());
        let zeroing = self.zeroing.as_ref().map_or(backend.usual_zeroing(), |key| *key.get_ref());
        Ok(DeviceConfig { name, backend, peak_force_n, slew_n_per_s, compensates_gravity, zeroing })
    }

    /// Nothing can be hurt by an ideal device, so it may be told to have no limit.
    fn slew(&self, backend: &Backend, toml: &TomlText<'_>) -> Result<Option<f64>, TomlReport> {
        match &self.slew_n_per_s {
            Some(slew) if *slew.get_ref() == f64::INFINITY && matches!(backend, Backend::Ideal(_)) => {
                Ok(Some(f64::INFINITY))
            }
            slew => slew.as_ref().map(|slew| toml.number(slew, SLEW)).transpose(),
        }
    }

    fn ideal(
        &self,
        own: (&str, usize),
        toml: &TomlText<'_>,
        directory: &Path,
    ) -> Result<Backend, TomlReport> {
        self.refuse_foreign(
            "ideal",
            &[
                ("description", span_of(&self.description)),
                ("trace", span_of(&self.trace)),
                ("card", span_of(&self.card)),
                ("gravity_compensation", span_of(&self.gravity_compensation)),
                ("zeroing", span_of(&self.zeroing)),
            ],
            toml,
        )?;
        self.refuse_foreign("ideal", &self.keys_of_simulated(), toml)?;
        Ok(Backend::Ideal(self.wish(own, toml, directory)?))
    }

    fn simulated(
        &self,
        own: (&str, usize),
        span: std::ops::Range<usize>,
        toml: &TomlText<'_>,
        directory: &Path,
    ) -> Result<Backend, TomlReport> {
        let foreign = [("trace", span_of(&self.trace)), ("card", span_of(&self.card))];
        self.refuse_foreign("simulated", &foreign, toml)?;
        Ok(Backend::Simulated {
            description: self.description("simulated", &span, toml, directory)?,
            wish: self.wish(own, toml, directory)?,
            holder: self.holder(toml, directory)?,
            seed: match &self.seed {
                Some(seed) => toml.integer(seed, 0..=i64::MAX)?.unsigned_abs(),
                None => 0,
            },
        })
    }

    /// `"nobody"` is none; a built-in's name stays what it is; else a file.
    fn holder(&self, toml: &TomlText<'_>, directory: &Path) -> Result<Option<HandChoice>, TomlReport> {
        let usual = PathBuf::from(DEFAULT_HAND);
        let named = self.hand_model.as_ref().map_or(&usual, Spanned::get_ref);
        let model = match named.to_str() {
            Some("nobody") => {
                let of_a_hand = [("firmness", span_of(&self.firmness)), ("tremor", span_of(&self.tremor))];
                return match of_a_hand.into_iter().find_map(|(key, span)| Some((key, span?))) {
                    None => Ok(None),
                    Some((key, span)) => Err(toml.refuse(
                        span,
                        format_args!("`{key}` of a hand that is nobody's"),
                        "not there",
                    )),
                };
            }
            Some(name) if model_file::builtin(name).is_some() => name.into(),
            _ => directory.join(named),
        };
        let firmness = match &self.firmness {
            None => Firmness::Usual,
            Some(word) => Firmness::from_name(word.get_ref()).ok_or_else(|| {
                toml.refuse(
                    word.span(),
                    format_args!("{:?}", word.get_ref()),
                    "\"light\", \"usual\" or \"firm\"",
                )
            })?,
        };
        let trembles = self.tremor.as_ref().is_none_or(|key| *key.get_ref());
        Ok(Some(HandChoice { model, firmness, trembles }))
    }

    fn wish(&self, own: (&str, usize), toml: &TomlText<'_>, directory: &Path) -> Result<Wish, TomlReport> {
        let start = self.start_m.as_ref().map_or(Ok([0.0; 3]), |list| toml.numbers(list, PLACE))?;
        Ok(Wish {
            hand: self.hand_source(own, toml, directory)?,
            start_m: Vector3::from(start),
            base_in_world: self.base(toml)?,
        })
    }

    /// The device's own name and place are those of its finger, unless told.
    fn hand_source(
        &self,
        (name, index): (&str, usize),
        toml: &TomlText<'_>,
        directory: &Path,
    ) -> Result<HandSource, TomlReport> {
        if let (None, Some(finger)) = (&self.hand, &self.finger) {
            return Err(toml.refuse(finger.span(), "`finger` without `hand`", "both, or `start_m`"));
        }
        if let (None, Some(finger)) = (&self.live_hand, &self.live_finger) {
            return Err(toml.refuse(finger.span(), "`live_finger` without `live_hand`", "both"));
        }
        match (&self.hand, &self.live_hand) {
            (Some(_), Some(live)) => {
                Err(toml.refuse(live.span(), "`live_hand` beside `hand`", "one of the two"))
            }
            (None, None) => Ok(HandSource::Nobody),
            (Some(hand), None) => Ok(HandSource::Script {
                file: directory.join(hand.get_ref()),
                finger: self.finger.as_ref().map_or_else(|| name.to_owned(), |key| key.get_ref().clone()),
            }),
            (None, Some(live)) => {
                let number =
                    self.live_finger.as_ref().map(|key| toml.integer(key, 0..=MAX_DEVICES as i64 - 1));
                let finger = number.transpose()?.map_or(index, |number| number.unsigned_abs() as usize);
                Ok(HandSource::Live { file: directory.join(live.get_ref()), finger })
            }
        }
    }

    fn replay(
        &self,
        span: std::ops::Range<usize>,
        toml: &TomlText<'_>,
        directory: &Path,
    ) -> Result<Backend, TomlReport> {
        self.refuse_foreign("replay", &[("card", span_of(&self.card))], toml)?;
        self.refuse_foreign("replay", &self.keys_of_wish(), toml)?;
        self.refuse_position("replay", toml)?;
        self.refuse_foreign("replay", &self.keys_of_simulated(), toml)?;
        let trace = self.needed("replay", &self.trace, "trace", &span, toml)?;
        Ok(Backend::Replay {
            description: self.description("replay", &span, toml, directory)?,
            trace: directory.join(trace),
            base_orientation: self.orientation(toml)?,
        })
    }

    fn emulated(
        &self,
        span: std::ops::Range<usize>,
        toml: &TomlText<'_>,
        directory: &Path,
    ) -> Result<Backend, TomlReport> {
        self.refuse_foreign("emulated", &[("trace", span_of(&self.trace))], toml)?;
        self.refuse_foreign("emulated", &self.keys_of_wish(), toml)?;
        self.refuse_position("emulated", toml)?;
        self.refuse_foreign("emulated", &self.keys_of_simulated(), toml)?;
        let card = self.needed("emulated", &self.card, "card", &span, toml)?;
        Ok(Backend::Emulated {
            description: self.description("emulated", &span, toml, directory)?,
            card: directory.join(card),
            base_orientation: self.orientation(toml)?,
        })
    }

    fn keys_of_simulated(&self) -> [(&'static str, Option<std::ops::Range<usize>>); 4] {
        [
            ("hand_model", span_of(&self.hand_model)),
            ("firmness", span_of(&self.firmness)),
            ("tremor", span_of(&self.tremor)),
            ("seed", span_of(&self.seed)),
        ]
    }

    fn keys_of_wish(&self) -> [(&'static str, Option<std::ops::Range<usize>>); 5] {
        [
            ("hand", span_of(&self.hand)),
            ("finger", span_of(&self.finger)),
            ("live_hand", span_of(&self.live_hand)),
            ("live_finger", span_of(&self.live_finger)),
            ("start_m", span_of(&self.start_m)),
        ]
    }

    /// Of a device with counters only its weight asks how it stands; a position would have no effect.
    fn refuse_position(&self, backend: &str, toml: &TomlText<'_>) -> Result<(), TomlReport> {
        self.base_position_m.as_ref().map_or(Ok(()), |list| {
            Err(toml.refuse(
                list.span(),
                format_args!("`base_position_m` in a device of backend \"{backend}\""),
                "`base_orientation_wxyz` alone, by which its weight pulls; where it stands is a layout's matter",
            ))
        })
    }

    fn needed(
        &self,
        backend: &str,
        key: &Option<Spanned<PathBuf>>,
        name: &str,
        span: &std::ops::Range<usize>,
        toml: &TomlText<'_>,
    ) -> Result<PathBuf, TomlReport> {
        key.as_ref().map(|path| path.get_ref().clone()).ok_or_else(|| {
            let article = if backend.starts_with('e') { "an" } else { "a" };
            let found = format!("no key `{name}` in {article} {backend} device");
            toml.refuse(span.clone(), found, format_args!("`{name} = \"FILE\"`"))
        })
    }

    /// A built-in's name stays what it is; else a file.
    fn description(
        &self,
        backend: &str,
        span: &std::ops::Range<usize>,
        toml: &TomlText<'_>,
        directory: &Path,
    ) -> Result<PathBuf, TomlReport> {
        let description = self.needed(backend, &self.description, "description", span, toml)?;
        Ok(match crate::device_file::builtin(&description.to_string_lossy()) {
            Some(_) => description,
            None => directory.join(description),
        })
    }

    fn refuse_foreign(
        &self,
        backend: &str,
        keys: &[(&str, Option<std::ops::Range<usize>>)],
        toml: &TomlText<'_>,
    ) -> Result<(), TomlReport> {
        match keys.iter().find_map(|(key, span)| span.clone().map(|span| (*key, span))) {
            Some((key, span)) => Err(toml.refuse(
                span,
                format_args!("`{key}` in a device of backend \"{backend}\""),
                "not there",
            )),
            None => Ok(()),
        }
    }

    fn base(&self, toml: &TomlText<'_>) -> Result<Isometry3<f64>, TomlReport> {
        let position =
            self.base_position_m.as_ref().map_or(Ok([0.0; 3]), |list| toml.numbers(list, PLACE))?;
        Ok(Isometry3::from_parts(Translation3::from(Vector3::from(position)), self.orientation(toml)?))
    }

    fn orientation(&self, toml: &TomlText<'_>) -> Result<UnitQuaternion<f64>, TomlReport> {
        let Some(list) = &self.base_orientation_wxyz else { return Ok(UnitQuaternion::identity()) };
        let [w, x, y, z] = toml.numbers(list, QUATERNION)?;
        let quaternion = Quaternion::new(w, x, y, z);
        let length = quaternion.norm();
        if (length - 1.0).abs() > LENGTH_TOLERANCE {
            let found = format_args!("a quaternion of length {length:.3}").to_string();
            return Err(toml.refuse(
                list.span(),
                found,
                "w, x, y, z of a rotation, whose squares add up to 1",
            ));
        }
        if (length - 1.0).abs() <= UNIT_ROUNDING {
            // As it is, so that what was written down is read back bit for bit.
            return Ok(UnitQuaternion::new_unchecked(quaternion));
        }
        Ok(UnitQuaternion::new_normalize(quaternion))
    }
}

/// As in a layout: four digits after the point are a rotation; what is further from length 1 is more likely another
/// order of components, or angles, and would push an arm the wrong way.
const LENGTH_TOLERANCE: f64 = 1e-3;

/// What rounding makes of the length of a quaternion that was brought to length 1.
const UNIT_ROUNDING: f64 = 4.0 * f64::EPSILON;

fn span_of<T>(key: &Option<Spanned<T>>) -> Option<std::ops::Range<usize>> {
    key.as_ref().map(Spanned::span)
}

/// Who holds a simulated arm, unless the configuration says.
const DEFAULT_HAND: &str = "pen-grip";

const PLACE: Allowed = Allowed { min: -100.0, max: 100.0, unit: "m" };
const QUATERNION: Allowed = Allowed { min: -2.0, max: 2.0, unit: "(w, x, y, z)" };
/// The range of a description's.
const SLEW: Allowed = crate::device_file::SLEW;
const PEAK: Allowed = Allowed { min: 0.0, max: 1000.0, unit: "N" };
