//! Cards that drive haptic devices, found by their PCI ids.

use rt_core::doctor::machine::{Machine, Obstacle};

/// What is known of a kind of card.
#[derive(Debug)]
pub(super) struct Model {
    /// What people call it.
    pub(super) name: &'static str,
    vendor: u16,
    device: u16,
    /// Vendor and device of the subsystem, where the chip alone does not tell the card.
    subsystem: Option<(u16, u16)>,
    /// Base address registers that the driver maps.
    pub(super) bars: &'static [u8],
    /// Offset in the first of them and value of a word that never changes.
    pub(super) cookie: Option<(usize, u32)>,
}

/// SensAble's card is a PLX 9050, told from other cards with that chip by its subsystem.
const PHANTOM: Model = Model {
    name: "PHANToM PCI card",
    vendor: 0x10b5,
    device: 0x9050,
    subsystem: Some((0x10b5, 0x9050)),
    bars: &[0, 2, 3],
    cookie: None,
};

const fn mesa(name: &'static str, device: u16) -> Model {
    Model {
        name,
        vendor: 0x2718,
        device,
        subsystem: None,
        bars: &[0],
        // hostmot2's register 0x100.
        cookie: Some((0x100, 0x55AA_CAFE)),
    }
}

const MODELS: &[Model] = &[
    PHANTOM,
    mesa("Mesa 5i24", 0x5124),
    mesa("Mesa 5i25", 0x5125),
    mesa("Mesa 5i25T", 0x5925),
    mesa("Mesa 6i25", 0x6125),
    mesa("Mesa 6i25T", 0x6925),
];

/// A card that is there.
#[derive(Debug)]
pub(super) struct Card {
    pub(super) model: &'static Model,
    /// Domain, bus, device, function.
    pub(super) address: String,
}

const DEVICES: &str = "/sys/bus/pci/devices";

impl Card {
    /// A file of it in sysfs.
    pub(super) fn file(&self, name: &str) -> String {
        format!("{DEVICES}/{}/{name}", self.address)
    }

    /// The file through which a base address register is mapped.
    pub(super) fn resource(&self, bar: u8) -> String {
        self.file(&format!("resource{bar}"))
    }

    /// What udev has to look at to mean this model.
    pub(super) fn udev_match(&self) -> String {
        let Model { vendor, device, subsystem, .. } = self.model;
        let mut rule = format!(
            "ACTION==\"add\", SUBSYSTEM==\"pci\", ATTR{{vendor}}==\"{vendor:#06x}\", ATTR{{device}}==\"{device:#06x}\""
        );
        if let Some((vendor, device)) = subsystem {
            rule += &format!(
                ", ATTR{{subsystem_vendor}}==\"{vendor:#06x}\", ATTR{{subsystem_device}}==\"{device:#06x}\""
            );
        }
        rule
    }
}

/// All cards that are there, by address.
pub(super) fn cards(machine: &Machine<'_>) -> Result<Vec<Card>, Obstacle> {
    let mut cards = Vec::new();
    for address in machine.names(DEVICES)? {
        if let Some(model) = model_of(machine, &address)? {
            cards.push(Card { model, address });
        }
    }
    Ok(cards)
}

fn model_of(machine: &Machine<'_>, address: &str) -> Result<Option<&'static Model>, Obstacle> {
    let id = |name: &str| id_in(machine, &format!("{DEVICES}/{address}/{name}"));
    let (vendor, device) = (id("vendor")?, id("device")?);
    let alike = MODELS.iter().find(|model| (model.vendor, model.device) == (vendor, device));
    let Some(model) = alike else { return Ok(None) };
    match model.subsystem {
        Some(wanted) if (id("subsystem_vendor")?, id("subsystem_device")?) != wanted => Ok(None),
        _ => Ok(Some(model)),
    }
}

/// A number such as `0x10b5`.
fn id_in(machine: &Machine<'_>, path: &str) -> Result<u16, Obstacle> {
    let line = machine.line(path)?;
    let number = line.strip_prefix("0x").and_then(|digits| u16::from_str_radix(digits, 16).ok());
    number.ok_or_else(|| Obstacle::garbled(path, &line))
}
