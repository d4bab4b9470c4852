//! The slow side of orders: reads them, checks them against the scene that will run then, makes what they need, sends them.
//!
//! Model: a script is sent as a whole before the run begins, each order with its tick: so it plays the same on every clock. Only
//! the worlds that it brings are made one after the other (`world_maker.rs`): two are there before their time, and clocks that can
//! wait wait for them.
//! The standard input is read by a thread of its own; its orders are for the next tick.

use super::gradual::MOST_TIMES;
use super::order::{FrictionChange, Move, Order, Replacement, Scale, Turn, Which};
use super::queue::{Dated, Lane, OrderReceiver, OrderSender, order_queue};
use super::words::{self, Words};
use super::world_maker::{self, Made, Wanted, WorldMaker};
use crate::book::Book;
use crate::bounded_lines::BoundedLines;
use crate::fast_step::FastStep;
use crate::record::View;
use crate::rig::{self, Rig};
use crate::row_queue::RowReceiver;
use crate::shown::Shown;
use io_driver::device::Extras;
use io_driver::say::say;
use nalgebra::{Isometry3, Vector3};
use rt_core::input_file;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};
use world::lists::SlowList;
use world::{FrictionSpec, Layout, Settings};

/// Where orders come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OrderSource {
    /// A script.
    File(PathBuf),
    /// The standard input.
    Input,
}

/// The most orders of a script; and the most replaced worlds that are kept until the slow side frees them.
const MOST_ORDERS: usize = 16_384;
/// Room for as many orders as wait, each with a long text.
const MAX_ORDERS_BYTES: u64 = 16 << 20;
/// A longer line of the standard input is no text: none is looked for behind it. An order has
/// [`LONGEST_LINE_BYTES`](words::LONGEST_LINE_BYTES) at most.
const MOST_LINE_BYTES: usize = 64 << 10;
/// Lines that may wait to be looked at; who writes more waits.
const LINES: usize = 64;

/// What orders need besides a rig.
#[derive(Debug, Clone, Default)]
pub struct Means {
    /// Where other scenes and their data are looked for.
    pub settings: Settings,
    /// What the devices tell besides positions.
    pub extras: Vec<Extras>,
    /// Where it is written down what was ordered.
    pub book: Book,
    /// Who steps the slow lists of worlds that are still to come; `None`: nobody, they have their turns in ticks.
    pub slow_lists: Option<Sender<SlowList>>,
    /// Whether what runs is shown to anybody.
    pub is_shown: bool,
    /// True if recordings show the scene.
    pub is_recorded_as_seen: bool,
}

/// A scene that will run once an order has been done.
pub struct Coming {
    /// Where its rows come from.
    pub rows: RowReceiver,
    /// What it is.
    pub rig: Rig,
    /// What recordings show of it.
    pub view: View,
    /// What others are shown of it, if there are any.
    pub shown: Option<Shown>,
}

/// Whoever takes orders.
pub struct Desk {
    rig: Rig,
    sender: OrderSender,
    means: Means,
    /// Of each entity, how many times the scene's stiffness and damping fingers will feel.
    times: Vec<[f64; 2]>,
    /// Of each entity, whether it can be moved.
    can_move: Vec<bool>,
    lines: Option<Receiver<String>>,
    coming: VecDeque<Coming>,
    /// Worlds that are made when there is room for them.
    later: VecDeque<Wanted>,
    /// Their maker, where time does not wait.
    maker: Option<WorldMaker>,
    /// The rig as it is now, once for all worlds to come that have it.
    shared_rig: Option<Arc<Rig>>,
    /// Files of the scenes that they bring.
    inputs: Vec<PathBuf>,
    script: Script,
}

/// What is known of orders that were given for later.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
enum Script {
    /// There are none.
    #[default]
    None,
    /// The scene stays as it is described.
    SameScene,
    /// It does not: what the desk knows of it is true only after them.
    OtherScene,
}

impl Desk {
    /// For a run of this rig; and the fast side's end of the queue.
    ///
    /// # Errors
    /// A script that cannot be read or played: its file, the line and what is wrong.
    pub fn open(rig: &Rig, source: &OrderSource, means: Means) -> Result<(Self, OrderReceiver), String> {
        let (mut desk, receiver) = Self::silent(rig, means)?;
        match source {
            OrderSource::File(file) => {
                desk.play(file)?;
                // The first are there when the run begins.
                if !desk.later.is_empty() && desk.means.slow_lists.is_some() {
                    let started = WorldMaker::start(desk.means.clone());
                    desk.maker =
                        Some(started.map_err(|error| rt_core::limits::no_thread(&error).to_string())?);
                }
            }
            OrderSource::Input => {
                let no_thread = |error| {
                    let missing = rt_core::limits::no_thread(&error);
                    format!("--orders -: cannot read the standard input: {missing}")
                };
                desk.lines = Some(listen().map_err(no_thread)?);
            }
        }
        Ok((desk, receiver))
    }

    /// One that takes orders from whoever has it.
    ///
    /// # Errors
    /// A rig that makes no step.
    pub fn silent(rig: &Rig, means: Means) -> Result<(Self, OrderReceiver), String> {
        let (sender, receiver) = order_queue(MOST_ORDERS);
        let mut desk = Self {
            rig: rig.clone(),
            sender,
            means,
            times: Vec::new(),
            can_move: Vec::new(),
            lines: None,
            coming: VecDeque::new(),
            later: VecDeque::new(),
            maker: None,
            shared_rig: None,
            inputs: Vec::new(),
            script: Script::None,
        };
        desk.take_note(&rig.fast_step().map_err(|error| error.to_string())?);
        Ok((desk, receiver))
    }

    /// The next scene that was ordered, for who takes its rows.
    pub fn take_coming(&mut self) -> Option<Coming> {
        self.coming.pop_front()
    }

    /// Files of the scenes that a script will bring.
    pub fn scenes_to_come(&self) -> Vec<PathBuf> {
        self.inputs.clone()
    }

    /// The slow side's turn: what came in meanwhile. What is refused is told, and the run goes on.
    pub fn step(&mut self) {
        self.sender.free_spent();
        self.make_worlds();
        let lines: Vec<String> = self.lines.iter().flat_map(Receiver::try_iter).collect();
        for line in lines {
            if let Err(error) = self.order_now(&line) {
                say(format_args!("phantom3: order refused: {error}"));
            }
        }
    }

    fn play(&mut self, file: &Path) -> Result<(), String> {
        let text = input_file::read_text(file, MAX_ORDERS_BYTES)
            .map_err(|error| format!("--orders {}: {error}", file.display()))?;
        let (mut last_s, mut orders) = (0.0, 0);
        for (number, line) in (1..).zip(text.lines()) {
            let wrong = |error: String| format!("{}:{number}: {error}", file.display());
            let Some((at_s, order)) = words::split_time(line).map_err(wrong)? else { continue };
            orders += 1;
            if at_s < last_s {
                return Err(wrong(format!(
                    "found at {at_s}, allowed: {last_s} s or later, as the line before it"
                )));
            }
            if orders > MOST_ORDERS {
                return Err(wrong(format!("too much for a script; allowed: {MOST_ORDERS} orders")));
            }
            last_s = at_s;
            let at_tick = self.tick_at(at_s);
            self.order(at_tick, order).map_err(wrong)?;
        }
        Ok(())
    }

    /// The tick of the run that is nearest to this time of it (s).
    fn tick_at(&self, at_s: f64) -> u64 {
        (at_s * 1e9 / self.rig.period_ns as f64).round() as u64
    }

    /// Makes an order of words, and sends it for this tick of the run. A line of nothing is none.
    ///
    /// # Errors
    /// What is wrong with it, and what is allowed.
    pub fn order(&mut self, at_tick: u64, line: &str) -> Result<(), String> {
        let Some(words) = words::parse(line)? else { return Ok(()) };
        let changes_scene = matches!(words, Words::Swap(_) | Words::Friction(..));
        self.send(at_tick, Lane::InTurn, words, line)?;
        if changes_scene {
            self.script = Script::OtherScene;
        } else if self.script == Script::None {
            self.script = Script::SameScene;
        }
        Ok(())
    }

    /// The same for the next tick, past those that wait for theirs as far as it does not concern what they change.
    ///
    /// # Errors
    /// As [`Desk::order`].
    pub fn order_now(&mut self, line: &str) -> Result<(), String> {
        let Some(words) = words::parse(line)? else { return Ok(()) };
        let goes_past = match words {
            Words::Tell(..) | Words::Text(_) | Words::Pause(_) | Words::Camera(_) => true,
            // A script knows entities by their numbers in its own scene.
            Words::Swap(_) => self.script == Script::None,
            _ => self.script != Script::OtherScene,
        };
        self.send(0, if goes_past { Lane::Now } else { Lane::InTurn }, words, line)
    }

    fn send(&mut self, at_tick: u64, lane: Lane, words: Words, line: &str) -> Result<(), String> {
        if self.sender.is_full(lane) {
            return Err(format!("{MOST_ORDERS} orders wait already"));
        }
        let order = self.make(words, lane)?;
        let number = self.means.book.add_order(words::without_comment(line).trim());
        // There is room.
        self.sender.send(Dated { at_tick, order, number }, lane);
        self.make_worlds();
        Ok(())
    }

    fn make(&mut self, words: Words, lane: Lane) -> Result<Order, String> {
        Ok(match words {
            Words::Reset if lane == Lane::InTurn => self.replace_later(false),
            Words::Reset => {
                let rig = self.shared_rig();
                Order::Replace(self.world(&rig, false)?)
            }
            Words::Scale(which, by, entity) => self.scale(which, by, entity.as_deref())?,
            Words::Friction(entity, spec) => self.friction(&entity, spec)?,
            Words::Move(entity, to_W, turn, over_s) => self.move_entity(&entity, to_W, turn, over_s)?,
            Words::Camera(pose) => self.camera(pose)?,
            Words::Pause(is_paused) => Order::Pause(is_paused),
            Words::Tell(kind, at_s) => Order::Tell(kind, at_s.map(|at_s| self.tick_at(at_s))),
            Words::Text(_) => Order::Text,
            Words::Swap(scene) => self.swap(&scene, lane)?,
        })
    }

    /// Order for a world that has the scene as it is at this place of the script, and is made later.
    fn replace_later(&mut self, is_other: bool) -> Order {
        let rig = self.shared_rig();
        self.later.push_back(Wanted { rig, is_other });
        Order::ReplaceByNext
    }

    fn shared_rig(&mut self) -> Arc<Rig> {
        Arc::clone(self.shared_rig.get_or_insert_with(|| Arc::new(self.rig.clone())))
    }

    /// Makes worlds to come as long as there is room for them, or takes those that were made.
    fn make_worlds(&mut self) {
        loop {
            let made = match &mut self.maker {
                Some(maker) => {
                    while maker.under_way() < self.sender.rooms_for_worlds()
                        && let Some(wanted) = self.later.pop_front()
                    {
                        maker.want(wanted);
                    }
                    maker.take()
                }
                None if self.sender.rooms_for_worlds() == 0 => None,
                None => self.later.pop_front().map(|wanted| world_maker::make(&wanted, &self.means)),
            };
            match made {
                None => return,
                Some(Ok(made)) => {
                    let world = self.take_made(made);
                    self.sender.send_world(world);
                }
                Some(Err(error)) => {
                    say(format_args!(
                        "phantom3: a world of the script cannot be made, and none after it is: {error}"
                    ));
                    (self.later, self.maker) = (VecDeque::new(), None);
                }
            }
        }
    }

    fn take_made(&mut self, (world, coming): Made) -> Box<Replacement> {
        self.coming.extend(coming);
        world
    }

    /// The world of a scene, made now.
    fn world(&mut self, rig: &Arc<Rig>, is_other: bool) -> Result<Box<Replacement>, String> {
        let made = world_maker::make(&Wanted { rig: Arc::clone(rig), is_other }, &self.means)?;
        Ok(self.take_made(made))
    }

    fn friction(&mut self, entity: &str, spec: FrictionSpec) -> Result<Order, String> {
        let number = self.number(entity)?;
        let friction = rig::friction(&spec)?;
        // So a reset keeps it.
        self.shared_rig = None;
        self.rig.scene.entities[number].friction = spec;
        let for_slow = Some(friction.clone());
        Ok(Order::Friction(Box::new(FrictionChange { entity: number, friction, for_slow })))
    }

    fn move_entity(
        &self,
        entity: &str,
        to_W: Option<Vector3<f64>>,
        turn: Turn,
        over_s: f64,
    ) -> Result<Order, String> {
        let number = self.number(entity)?;
        if !self.can_move[number] {
            return Err(format!(
                "{entity} cannot be moved: it has no end, and the scene has too many things that move for one list, \
                 of which all are near it; allowed: what has an end, or a scene with lists = {{ fast_bodies = ... }} \
                 as large as it has things that move"
            ));
        }
        Ok(Order::Move(Move { entity: number, to_W, turn, over_s }))
    }

    fn scale(&mut self, which: Which, by: f64, entity: Option<&str>) -> Result<Order, String> {
        let entity = entity.map(|name| self.number(name)).transpose()?;
        let chosen = match entity {
            Some(number) => number..number + 1,
            None => 0..self.times.len(),
        };
        // A hair more than what rounding makes of ten times 1.1 and ten times 1 / 1.1.
        let allowed = MOST_TIMES.recip() * (1.0 - 1e-9)..=MOST_TIMES * (1.0 + 1e-9);
        let times = |times: &[f64; 2]| times[which as usize] * by;
        if let Some(at) = chosen.clone().find(|&at| !allowed.contains(&times(&self.times[at]))) {
            return Err(format!(
                "{} would have {} times what the scene says; allowed: {} to {MOST_TIMES} times",
                self.rig.scene.entities[at].name,
                times(&self.times[at]),
                MOST_TIMES.recip(),
            ));
        }
        self.times[chosen].iter_mut().for_each(|times| times[which as usize] *= by);
        Ok(Order::Scale(Scale { which, by, entity }))
    }

    fn camera(&mut self, pose: Isometry3<f64>) -> Result<Order, String> {
        let carries = |layout: &&mut Layout| layout.camera().is_some();
        let layout = self.rig.layout.as_mut().filter(carries).ok_or(
            "no device goes with the camera; allowed: a run with a --layout that says `attached_to = \"camera\"`",
        )?;
        // So worlds to come have it.
        self.shared_rig = None;
        *layout = std::mem::take(layout).with_camera(pose);
        Ok(Order::Camera(pose))
    }

    fn swap(&mut self, scene: &Path, lane: Lane) -> Result<Order, String> {
        let rig = self.rig.beside(scene, &self.means.settings).map_err(|error| error.to_string())?;
        let (needed, has) = (rig.device_count(), self.rig.device_count());
        if needed > has {
            return Err(format!(
                "swap: the fingers of {} need {needed} devices, the run has {has}; take fingers out of it, or \
                 begin with the scene that has more",
                scene.display()
            ));
        }
        if lane == Lane::Now {
            let shared_rig = Arc::new(rig);
            let world = self.world(&shared_rig, true)?;
            self.take_note(&world.step);
            (self.rig, self.shared_rig) = (Rig::clone(&shared_rig), Some(shared_rig));
            return Ok(Order::Replace(world));
        }
        // What is wrong with it is told now, and what it needs is made later.
        let step = rig.fast_step().map_err(|error| error.to_string())?;
        self.take_note(&step);
        self.inputs.extend(rig.input_files());
        (self.rig, self.shared_rig) = (rig, None);
        Ok(self.replace_later(true))
    }

    /// What is known of the scene that will run.
    fn take_note(&mut self, step: &FastStep) {
        self.can_move = (0..step.entities().len()).map(|entity| step.can_drive(entity)).collect();
        self.times = vec![[1.0; 2]; step.entities().len()];
    }

    fn number(&self, name: &str) -> Result<usize, String> {
        let entities = &self.rig.scene.entities;
        entities.iter().position(|entity| entity.name == name).ok_or_else(|| {
            let names: Vec<&str> = entities.iter().take(TOLD).map(|entity| entity.name.as_str()).collect();
            let more = if entities.len() > TOLD { ", ..." } else { "" };
            format!("there is no entity {name}; allowed: {}{more}", names.join(", "))
        })
    }
}

/// So many names are told.
const TOLD: usize = 20;

/// The lines of the standard input. The thread ends with it, or with the process.
fn listen() -> std::io::Result<Receiver<String>> {
    let (send, receive) = mpsc::sync_channel(LINES);
    std::thread::Builder::new().name("orders".into()).spawn(move || {
        let input = BoundedLines::new(std::io::stdin(), MOST_LINE_BYTES);
        for (number, line) in (1..).zip(BufReader::new(input).split(b'\n')) {
            let line = match line {
                Ok(line) => text(number, line),
                Err(error) => {
                    say(format_args!(
                        "phantom3: --orders -: {error}; no orders are read from here on; allowed: lines of text of {} \
                         bytes at most",
                        words::LONGEST_LINE_BYTES
                    ));
                    break;
                }
            };
            if line.is_some_and(|line| send.send(line).is_err()) {
                break;
            }
        }
    })?;
    Ok(receive)
}

/// The line of this number as text; `None`, which is told: it is none.
fn text(number: u64, line: Vec<u8>) -> Option<String> {
    let Ok(line) = String::from_utf8(line) else {
        say(format_args!(
            "phantom3: order refused: line {number} is not UTF-8 text; write it with the characters of UTF-8"
        ));
        return None;
    };
    // Windows' shells put a byte order mark before what they pipe.
    Some(if number == 1 { line.trim_start_matches('\u{feff}').to_owned() } else { line })
}
