//! Rows of a table.
//!
//! Model: the header says which columns there are; they have to be those that such a recording has. The length of a tick
//! is the shortest time between two of the first rows. A last line without its end is left out: half a number is a number.
//! Windows line ends and a byte order mark, which editors and spreadsheets add, do not count.

use super::csv_lines::CsvLines;
use super::tick_order::{TickOrder, check_period};
use super::{ReadError, check_text};
use crate::columns::{Column, Names, columns, feature_named, friction_named};
use crate::row::{BodyRow, FingerRow, Row};
use io_driver::device::{Extras, run_time_s};
use nalgebra::{Quaternion, Vector3};
use physics::GraspQuality;
use rt_core::plain_text::{beginning, quoted};
use rt_core::separators;
use shm_abi::MAX_DEVICES;
use std::collections::{HashMap, VecDeque};
use std::path::{Path, PathBuf};

/// So many rows are looked at for the length of a tick.
const LOOK_AHEAD: usize = 1000;
/// Or so many bytes of them.
const LOOK_AHEAD_BYTES: usize = 16 << 20;
/// As many entities as a scene can have.
const MOST_NAMES: usize = 100_000;
/// And more environments with doors than anybody made.
const MOST_SPACES: usize = 1000;
/// Where a single row says nothing of it (ns).
const USUAL_PERIOD_NS: u64 = 1_000_000;

pub(super) struct CsvRows {
    file: PathBuf,
    lines: CsvLines,
    ahead: VecDeque<String>,
    columns: Vec<Column>,
    line: u64,
    /// Place of an entity in the list of names.
    known: HashMap<String, u32>,
    order: TickOrder,
    pub(super) names: Names,
    pub(super) period_ns: u64,
}

impl CsvRows {
    pub(super) fn open(file: &Path) -> Result<Self, ReadError> {
        let mut lines = CsvLines::open(file)?;
        let header = lines.header()?;
        let mut rows = Self {
            file: file.into(),
            lines,
            ahead: VecDeque::new(),
            columns: Vec::new(),
            line: 0,
            known: HashMap::new(),
            order: TickOrder::default(),
            names: Names::default(),
            period_ns: USUAL_PERIOD_NS,
        };
        let no_recording = |why: String| ReadError::NoRecording { file: file.into(), why };
        rows.names = names_in(&header);
        rows.columns = columns(&rows.names);
        check_header(&header, &rows.names, &rows.columns).map_err(no_recording)?;
        let mut bytes = 0;
        while rows.ahead.len() < LOOK_AHEAD
            && bytes < LOOK_AHEAD_BYTES
            && let Some(line) = rows.lines.next_line()?
        {
            bytes += line.len();
            rows.ahead.push_back(line);
        }
        rows.period_ns = period_of(&rows.ahead);
        rows.line = 1;
        check_period(rows.period_ns).map_err(|why| rows.bad_row(2, why))?;
        Ok(rows)
    }

    pub(super) fn next_row(&mut self) -> Result<Option<(Row, Vec<BodyRow>)>, ReadError> {
        let line = match self.ahead.pop_front() {
            Some(line) => line,
            None => match self.lines.next_line()? {
                Some(line) => line,
                None => return Ok(None),
            },
        };
        self.line += 1;
        let row = self.parse(&line).map_err(|why| self.bad_row(self.line, why))?;
        self.order.check(row.0.run_tick, self.period_ns).map_err(|why| self.bad_row(self.line, why))?;
        Ok(Some(row))
    }

    fn bad_row(&self, line: u64, why: String) -> ReadError {
        ReadError::BadRow { file: self.file.clone(), line, why }
    }

    /// End of the table, if that is in the middle of a row.
    pub(super) fn cut(&self) -> Option<&str> {
        self.lines.cut.as_deref()
    }

    fn parse(&mut self, line: &str) -> Result<(Row, Vec<BodyRow>), String> {
        let cells: Vec<&str> = line.split(',').collect();
        check_cells(line, cells.len(), self.columns.len())?;
        let mut cells = Cells {
            cells: &cells,
            columns: &self.columns,
            at: 0,
            entities: &mut self.names.entities,
            known: &mut self.known,
            spaces: &mut self.names.spaces,
        };
        let mut row = Row { run_tick: cells.tick("t", self.period_ns)?, ..Row::empty() };
        let shape = &Shape {
            extras: &self.names.extras,
            passive: &self.names.passive,
            torques: &self.names.torques,
            ties: &self.names.ties,
        };
        for (index, finger) in row.fingers.iter_mut().take(self.names.fingers.len()).enumerate() {
            *finger = cells.finger(index, shape)?;
        }
        let tells = (self.names.grasp_quality, self.names.lists);
        let mut bodies = vec![BodyRow::default(); self.names.bodies.len()];
        for body in &mut bodies {
            *body = cells.body(tells)?;
            if self.names.as_of {
                let tick = cells.tick("the time as of which a thing is there", self.period_ns)?;
                body.as_of = Some(tick).filter(|tick| *tick != row.run_tick);
            }
        }
        Ok((row, bodies))
    }
}

/// Which columns the fingers have.
struct Shape<'a> {
    extras: &'a [Extras],
    passive: &'a [bool],
    torques: &'a [bool],
    ties: &'a [bool],
}

/// The cells of a row, taken one after the other.
struct Cells<'a> {
    cells: &'a [&'a str],
    columns: &'a [Column],
    at: usize,
    entities: &'a mut Vec<String>,
    known: &'a mut HashMap<String, u32>,
    spaces: &'a mut Option<Vec<String>>,
}

impl Cells<'_> {
    fn take(&mut self) -> (&str, &Column) {
        self.at += 1;
        (self.cells[self.at - 1], &self.columns[self.at - 1])
    }

    fn number(&mut self) -> Result<f64, String> {
        let (cell, column) = self.take();
        let number = cell.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| no_number(cell, column, "a number"))
    }

    fn whole(&mut self) -> Result<u64, String> {
        let (cell, column) = self.take();
        cell.parse().map_err(|_| no_number(cell, column, "a whole number"))
    }

    fn numbers<const N: usize>(&mut self) -> Result<[f64; N], String> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number()?;
        }
        Ok(numbers)
    }

    fn vector(&mut self) -> Result<Vector3<f64>, String> {
        self.numbers().map(Vector3::from)
    }

    fn name(&mut self) -> Result<String, String> {
        let at = self.at;
        let (cell, column) = self.take();
        check_text(cell).map_err(|why| format!("column {} ({}): {why}", at + 1, beginning(&column.name)))?;
        Ok(cell.to_owned())
    }

    fn entity(&mut self) -> Result<Option<u32>, String> {
        let name = self.name()?;
        if name.is_empty() {
            return Ok(None);
        }
        if let Some(index) = self.known.get(&name) {
            return Ok(Some(*index));
        }
        check_count(self.entities.len(), MOST_NAMES, "entities")?;
        let index = self.entities.len() as u32;
        self.known.insert(name.clone(), index);
        self.entities.push(name);
        Ok(Some(index))
    }

    fn space(&mut self) -> Result<u32, String> {
        if self.spaces.is_none() {
            return Ok(0);
        }
        let name = self.name()?;
        let Some(spaces) = self.spaces.as_mut().filter(|_| !name.is_empty()) else { return Ok(0) };
        if let Some(index) = spaces.iter().position(|space| *space == name) {
            return Ok(index as u32 + 1);
        }
        check_count(spaces.len(), MOST_SPACES, "spaces")?;
        spaces.push(name);
        Ok(spaces.len() as u32)
    }

    fn word<T>(&mut self, named: fn(&str) -> Option<T>) -> Result<T, String> {
        let (cell, column) = self.take();
        named(cell).ok_or_else(|| {
            format!("{} is {}, which is no word for it", beginning(&column.name), quoted(cell))
        })
    }

    fn finger(&mut self, index: usize, shape: &Shape<'_>) -> Result<FingerRow, String> {
        let is = |flags: &[bool]| flags.get(index).copied().unwrap_or_default();
        let mut row = FingerRow {
            hip: self.vector()?,
            god_object: self.vector()?,
            force_on_user: self.vector()?,
            entity: self.entity()?,
            feature: self.word(feature_named)?,
            friction: self.word(friction_named)?,
            applied_on_user: self.vector()?,
            ..FingerRow::default()
        };
        let extras = shape.extras.get(index).copied().unwrap_or_default();
        if extras.orientation {
            (row.orientation_wxyz, row.has_orientation) = (self.numbers()?, true);
        }
        if extras.buttons {
            row.buttons = self.whole()?;
        }
        if is(shape.passive) {
            [row.energy_j, row.controlled_n] = self.numbers()?;
        }
        if is(shape.torques) {
            row.torque_on_user = self.vector()?;
        }
        if is(shape.ties) {
            row.attached = self.entity()?;
        }
        row.space = self.space()?;
        Ok(row)
    }

    /// The tick of a time (s).
    fn tick(&mut self, what: &str, period_ns: u64) -> Result<u64, String> {
        let t_s = self.number()?;
        let ticks = (t_s * 1e9 / period_ns as f64).round();
        if ticks < 0.0 || run_time_s((ticks as u64).cast_signed(), period_ns) != t_s {
            return Err(format!("{what} is {t_s:?}, which is no multiple of the tick of {period_ns} ns"));
        }
        Ok(ticks as u64)
    }

    fn body(&mut self, (tells_grasp, tells_list): (bool, bool)) -> Result<BodyRow, String> {
        let position = self.vector()?;
        let [w, x, y, z] = self.numbers()?;
        let (velocity, angular_velocity) = (self.vector()?, self.vector()?);
        let mut grasp = GraspQuality::default();
        if tells_grasp {
            grasp = GraspQuality {
                contacts: self.whole()? as usize,
                rank: self.whole()? as usize,
                residual: self.number()?,
                has_force_closure: self.whole()? != 0,
            };
        }
        let is_slow = tells_list && self.whole()? != 0;
        let orientation = Quaternion::new(w, x, y, z);
        Ok(BodyRow { position, orientation, velocity, angular_velocity, grasp, is_slow, as_of: None })
    }
}

fn no_number(cell: &str, column: &Column, allowed: &str) -> String {
    format!("{} is {}, allowed: {allowed}", beginning(&column.name), quoted(cell))
}

fn check_count(known: usize, most: usize, what: &str) -> Result<(), String> {
    if known < most { Ok(()) } else { Err(format!("more than {most} {what} are named; allowed: as many")) }
}

/// Refuses a row with more or fewer cells than there are columns.
pub(crate) fn check_cells(line: &str, found: usize, expected: usize) -> Result<(), String> {
    if found == expected {
        return Ok(());
    }
    if line.is_empty() {
        return Err("found an empty line, with rows behind it".into());
    }
    let hint = separators::hint_for_row(line, expected);
    Err(format!("found {found} cells, expected {expected}{hint}"))
}

/// Why a first line is not that of a recording, if it is none.
pub(crate) fn header_fault(header: &str) -> Option<String> {
    let names = names_in(header);
    let columns = columns(&names);
    check_header(header, &names, &columns).err()
}

/// Says which column of a first line is the first that is not that of a recording.
fn check_header(header: &str, names: &Names, expected: &[Column]) -> Result<(), String> {
    let hint = separators::hint_for_header(header);
    if names.fingers.is_empty() {
        return Err(format!(
            "its first line is {}, without a column such as f0_hip_x of a finger{hint}",
            quoted(header)
        ));
    }
    for (index, name) in header.split(',').enumerate() {
        check_text(name).map_err(|why| format!("its column {}: {why}", index + 1))?;
    }
    let mut found = header.split(',');
    for (index, column) in expected.iter().enumerate() {
        match found.next() {
            Some(name) if name == column.name => {}
            Some(name) => {
                return Err(format!(
                    "its column {} is {}, expected {}{hint}",
                    index + 1,
                    quoted(name),
                    quoted(&column.name)
                ));
            }
            None => {
                return Err(format!(
                    "its first line ends behind {index} columns, expected {}{hint}",
                    quoted(&column.name)
                ));
            }
        }
    }
    found.next().map_or(Ok(()), |name| {
        Err(format!(
            "its column {} is {}, expected no more than {}",
            expected.len() + 1,
            quoted(name),
            expected.len()
        ))
    })
}

/// Which names a header is made of, as far as it is one.
fn names_in(header: &str) -> Names {
    let all: Vec<&str> = header.split(',').collect();
    let named = |ending: &str| -> Vec<String> {
        all.iter().filter_map(|column| column.strip_suffix(ending)).map(str::to_owned).collect()
    };
    let mut fingers = named("_hip_x");
    fingers.truncate(MAX_DEVICES);
    let bodies = named("_vx");
    // The columns of the fingers end where the first object's begin.
    let first_body = bodies.first().map(|name| format!("{name}_x"));
    let end =
        first_body.and_then(|first| all.iter().position(|column| *column == first)).unwrap_or(all.len());
    let has = |name: &String, ending: &str| all[..end].contains(&&*format!("{name}_{ending}"));
    let each = |ending: &str| fingers.iter().map(|name| has(name, ending)).collect::<Vec<bool>>();
    let of_bodies =
        |ending: &str| bodies.first().is_some_and(|body| all[end..].contains(&&*format!("{body}_{ending}")));
    let extras =
        fingers.iter().map(|name| Extras { orientation: has(name, "qw"), buttons: has(name, "buttons") });
    Names {
        extras: extras.collect(),
        passive: each("energy"),
        torques: each("torque_x"),
        ties: each("attached"),
        grasp_quality: all[end..].iter().any(|column| column.ends_with("_closure")),
        spaces: each("space").contains(&true).then(Vec::new),
        lists: of_bodies("list"),
        as_of: of_bodies("as_of"),
        entities: Vec::new(),
        fingers,
        bodies,
    }
}

/// The shortest time between two rows (ns).
fn period_of(lines: &VecDeque<String>) -> u64 {
    // A time that is none is told with its line.
    let time_s = |line: &String| line.split(',').next()?.parse::<f64>().ok().filter(|t| t.is_finite());
    let time_ns = |line: &String| Some((time_s(line)? * 1e9).round() as u64);
    let times: Vec<u64> = lines.iter().filter_map(time_ns).collect();
    let steps = times.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).filter(|step| *step > 0);
    steps.min().unwrap_or(USUAL_PERIOD_NS)
}
