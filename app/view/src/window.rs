//! The window: what people look at and reach into while a run goes on.
//!
//! Model: it has a thread of its own, which draws some sixty times a second what the run last told ([`News`]) and asks for
//! what people want ([`Ask`]). It has no real-time rights, and nobody waits for it. The desktop's libraries are loaded when
//! it is opened: a machine without them, or without a display, says so, and the run goes on.
//!
//! One process has one window at most, once.

mod controls;
#[allow(unsafe_code, reason = "a handler of errors for a library that is loaded at run time")]
mod display_loss;
mod key_listener;
mod looker;
mod scene;
mod writing;

use crate::eyes::Eyes;
use crate::input::Bindings;
use crate::news::{Ask, News, Reins};
use crate::stage::Stage;
use eframe::egui;
use looker::Looker;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// So much news may wait; what is told while nobody looks is left out.
const WAITING: usize = 64;
/// Between two looks whether it has closed.
const CLOSING: Duration = Duration::from_millis(1);
/// Desktops that answer at all answer within this time.
const OPENING: Duration = Duration::from_secs(20);

/// How a window begins.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowSpec {
    /// What its frame says.
    pub title: String,
    /// Width and height (points of the desktop).
    pub size: [f32; 2],
    /// Its upper left corner; `None`: the desktop says.
    pub position: Option<[f32; 2]>,
    /// Whether it fills the screen.
    pub is_fullscreen: bool,
    /// Whether there are shadows.
    pub with_shadows: bool,
    /// Who looks.
    pub eyes: Eyes,
    /// Which keys do what.
    pub bindings: Bindings,
    /// Where pictures go that people take.
    pub pictures: PathBuf,
    /// Whether devices go where its camera goes.
    pub carries_devices: bool,
}

/// Why there is no window.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoWindow {
    /// Nobody to show it to.
    #[error("no window: there is no display (neither WAYLAND_DISPLAY nor DISPLAY is set)")]
    NoDisplay,
    /// The desktop, or its graphics, would not.
    #[error("no window: {0}")]
    Refused(String),
}

/// A window that was opened; closes when dropped.
pub struct OpenWindow {
    news: SyncSender<News>,
    asks: Receiver<Ask>,
    context: egui::Context,
    thread: Option<JoinHandle<()>>,
    left_out: u64,
    has_reins: bool,
}

/// Whether there is anybody to show a window to.
pub fn has_display() -> bool {
    ["WAYLAND_DISPLAY", "DISPLAY"].iter().any(|name| std::env::var_os(name).is_some_and(|at| !at.is_empty()))
}

/// The display of the window that was opened is gone: its thread stands still for ever then.
pub fn is_display_lost() -> bool {
    display_loss::is_lost()
}

impl OpenWindow {
    /// Opens it on a stage; with hands of its own if there are reins to pull.
    ///
    /// # Errors
    /// Why there is none.
    pub fn open(spec: WindowSpec, stage: Stage, reins: Option<Box<dyn Reins>>) -> Result<Self, NoWindow> {
        if !has_display() {
            return Err(NoWindow::NoDisplay);
        }
        let (news, told) = sync_channel(WAITING);
        let (ask, asks) = channel();
        let (ready, is_ready) = channel();
        let has_reins = reins.is_some();
        let refused = |error: String| NoWindow::Refused(error);
        display_loss::outlive_the_server();
        let thread = std::thread::Builder::new()
            .name("window".into())
            .spawn(move || show(spec, stage, (told, ask, reins), &ready))
            .map_err(|error| refused(rt_core::limits::no_thread(&error)))?;
        let context = is_ready
            .recv_timeout(OPENING)
            .map_err(|_| refused("the desktop does not answer".into()))?
            .map_err(refused)?;
        Ok(Self { news, asks, context, thread: Some(thread), left_out: 0, has_reins })
    }

    /// Tells it something, if it has time to listen; answers what it had no time for.
    pub fn tell(&mut self, news: News) -> Option<News> {
        let Err(TrySendError::Full(news)) = self.news.try_send(news) else { return None };
        self.left_out += 1;
        Some(news)
    }

    /// What people want; ends with [`Ask::End`] when the window was closed.
    pub fn asked(&self) -> impl Iterator<Item = Ask> {
        self.asks.try_iter()
    }

    /// The run's fingers are moved by its hands.
    pub fn has_reins(&self) -> bool {
        self.has_reins
    }

    /// Whether it is there still.
    pub fn is_open(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }
}

impl Drop for OpenWindow {
    fn drop(&mut self) {
        let _ = self.news.try_send(News::Over);
        self.context.send_viewport_cmd(egui::ViewportCommand::Close);
        self.context.request_repaint();
        let Some(thread) = self.thread.take() else { return };
        // One that waits for a display that is gone does not end.
        while !thread.is_finished() && !is_display_lost() {
            std::thread::sleep(CLOSING);
        }
        if thread.is_finished() {
            let _ = thread.join();
        }
    }
}

/// What a window hears, asks and pulls.
type Ends = (Receiver<News>, Sender<Ask>, Option<Box<dyn Reins>>);

fn show(spec: WindowSpec, stage: Stage, ends: Ends, ready: &Sender<Result<egui::Context, String>>) {
    let failed = ready.clone();
    let options = options(&spec);
    let title = spec.title.clone();
    let (told, ask, reins) = ends;
    let made = eframe::run_native(
        &title,
        options,
        Box::new(move |creation| {
            let looker = Looker::new(creation, &spec, stage, (told, ask, reins))?;
            // Nobody waits any more: the run is over.
            let _ = failed.send(Ok(creation.egui_ctx.clone()));
            Ok(Box::new(looker))
        }),
    );
    if let Err(error) = made {
        let _ = ready.send(Err(in_short(&error.to_string())));
    }
}

/// What the desktop said, without the places in other people's sources where it was said.
fn in_short(words: &str) -> String {
    words
        .rsplit_once(".rs:")
        .and_then(|(_, rest)| rest.split_once(": "))
        .map_or(words, |(_, said)| said)
        .into()
}

/// The first of its kind that is not there yet.
fn snapshot_file(directory: &Path) -> PathBuf {
    let name = |number: u32| directory.join(format!("phantom3-{number:04}.png"));
    let free = (1..10_000).find(|number| !name(*number).exists());
    name(free.unwrap_or(0))
}

fn options(spec: &WindowSpec) -> eframe::NativeOptions {
    let mut viewport = egui::ViewportBuilder::default().with_inner_size(spec.size).with_app_id("phantom3");
    viewport.position = spec.position.map(Into::into);
    viewport.fullscreen = Some(spec.is_fullscreen);
    eframe::NativeOptions {
        viewport,
        renderer: eframe::Renderer::Glow,
        depth_buffer: 24,
        multisampling: 4,
        // The thread that starts drivers is another one.
        event_loop_builder: Some(Box::new(|builder| {
            use winit::platform::{wayland::EventLoopBuilderExtWayland, x11::EventLoopBuilderExtX11};
            EventLoopBuilderExtX11::with_any_thread(builder, true);
            EventLoopBuilderExtWayland::with_any_thread(builder, true);
        })),
        ..eframe::NativeOptions::default()
    }
}

#[cfg(test)]
mod tests {
    use super::in_short;

    #[test]
    fn what_is_told_names_no_source() {
        let said =
            "winit EventLoopError: os error at /a/linux/mod.rs:788: Failed to open connection to X server";
        assert_eq!(in_short(said), "Failed to open connection to X server");
        assert_eq!(in_short("no OpenGL: none"), "no OpenGL: none");
    }
}
