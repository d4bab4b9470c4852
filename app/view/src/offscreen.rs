//! Drawing without a display: a graphics context of nobody's window.
//!
//! Model: threads as many as drawing takes are tried first, since Mesa waits for ever for those that it does not get.
//! `libEGL` is looked for when a picture is wanted, and asked for a context without a surface. Mesa's has one that
//! draws in software where there is no graphics card. A machine without the library misses pictures and nothing else.
//! All contexts of a process draw with the same threads of Mesa. So a thread draws a single colour first: should Mesa lack
//! one of its own, it is that thread which waits for ever, and nobody waits for it longer than [`TRIAL`].

use khronos_egl as egl;
use rt_core::limits;
use std::fs::File;
use std::io;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use three_d::{ClearState, Interpolation, Texture2D, Wrapping};

/// `EGL_PLATFORM_SURFACELESS_MESA`.
const SURFACELESS: egl::Enum = 0x31DD;
/// What to install where it is missing.
const REMEDY: &str = "on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri";

/// Why there are no pictures.
#[derive(Debug, thiserror::Error)]
pub enum NoPictures {
    /// The library is not there.
    #[error("no pictures: libEGL.so.1 cannot be loaded ({0}); {REMEDY}")]
    NoLibrary(String),
    /// It is, and has nothing to draw with.
    #[error("no pictures: libEGL {step} ({reason}); {REMEDY}")]
    NoContext {
        /// Step that failed.
        step: &'static str,
        /// In its words.
        reason: String,
    },
    /// A limit of this process is the likely cause.
    #[error("no pictures: libEGL {step} ({reason}); it may lack memory: raise the limit {limit}")]
    Memory {
        /// Step that failed.
        step: &'static str,
        /// In its words.
        reason: String,
        /// In words.
        limit: String,
    },
    /// The same, of files.
    #[error("no pictures: libEGL {step} ({reason}); {remedy}")]
    Files {
        /// Step that failed.
        step: &'static str,
        /// In its words.
        reason: String,
        /// In words.
        remedy: String,
    },
    /// Lack of threads: drawing in software would wait for ever for those that it did not get.
    #[error("no pictures: {0}")]
    Threads(String),
    /// Nothing is drawn, and no error told.
    #[error(
        "no pictures: the graphics library drew nothing within {} s, as happens for ever when it lacks one of its threads; {}",
        TRIAL.as_secs(), limits::more_processes()
    )]
    Stuck,
    /// There is a context, and it cannot do what is needed.
    #[error("no pictures: {0}")]
    Graphics(String),
}

/// A context in which this thread draws, as long as it lives.
pub struct Offscreen {
    /// What draws.
    pub context: three_d::Context,
    /// Who draws, in its own words.
    pub renderer: String,
    egl: egl::DynamicInstance<egl::EGL1_5>,
    display: egl::Display,
    own: egl::Context,
}

impl Offscreen {
    /// Makes one and makes it this thread's.
    ///
    /// # Errors
    /// What is missing, and what to do about it.
    pub fn new() -> Result<Self, NoPictures> {
        refuse_without_threads()?;
        refuse_if_stuck()?;
        Self::make()
    }

    fn make() -> Result<Self, NoPictures> {
        // SAFETY: the library is the system's own graphics library; its initialisers are trusted as every program's are that
        // draws anything.
        let egl = unsafe { egl::DynamicInstance::<egl::EGL1_5>::load_required() }
            .map_err(|error| no_library(error.to_string()))?;
        let display = open(&egl)?;
        let own = make_context(&egl, display)?;
        // SAFETY: the functions are those of the context that was made current on this thread, and used on no other.
        let gl = unsafe {
            three_d::context::Context::from_loader_function(|name| {
                egl.get_proc_address(name).map_or(std::ptr::null(), |function| function as *const _)
            })
        };
        let renderer = name_of(&gl);
        let context = three_d::Context::from_gl_context(Arc::new(gl))
            .map_err(|error| NoPictures::Graphics(error.to_string()))?;
        Ok(Self { context, renderer, egl, display, own })
    }

    /// A single colour, read back.
    fn draw_a_colour(&self) {
        let (near, edge) = (Interpolation::Nearest, Wrapping::ClampToEdge);
        let colour = Texture2D::new_empty::<[u8; 4]>(&self.context, 64, 64, near, near, None, edge, edge);
        let target = colour.as_color_target(None);
        let _: Vec<[u8; 4]> = target.clear(ClearState::color(1.0, 1.0, 1.0, 1.0)).read();
    }
}

impl Drop for Offscreen {
    fn drop(&mut self) {
        // It is over either way.
        let _ = self.egl.make_current(self.display, None, None, None);
        let _ = self.egl.destroy_context(self.display, self.own);
    }
}

fn open(egl: &egl::DynamicInstance<egl::EGL1_5>) -> Result<egl::Display, NoPictures> {
    // SAFETY: the default display of a platform without displays; nothing is pointed to but the list, which ends as it must.
    let display = unsafe { egl.get_platform_display(SURFACELESS, egl::DEFAULT_DISPLAY, &[egl::ATTRIB_NONE]) };
    let display = display.map_err(failed("knows no display without a surface"))?;
    egl.initialize(display).map_err(failed("cannot be started"))?;
    Ok(display)
}

fn make_context(
    egl: &egl::DynamicInstance<egl::EGL1_5>,
    display: egl::Display,
) -> Result<egl::Context, NoPictures> {
    egl.bind_api(egl::OPENGL_API).map_err(failed("has no OpenGL"))?;
    // A window's would be wanted if nothing were said.
    let wanted = [egl::SURFACE_TYPE, egl::PBUFFER_BIT, egl::RENDERABLE_TYPE, egl::OPENGL_BIT, egl::NONE];
    let config = egl.choose_first_config(display, &wanted).map_err(failed("has no configuration"))?;
    let config =
        config.ok_or(NoPictures::NoContext { step: "has no configuration", reason: "none fits".into() })?;
    let version = [egl::CONTEXT_MAJOR_VERSION, 3, egl::CONTEXT_MINOR_VERSION, 3, egl::NONE];
    let context = egl
        .create_context(display, config, None, &version)
        .map_err(failed("makes no context of OpenGL 3.3"))?;
    egl.make_current(display, None, None, Some(context)).map_err(failed("does not give its context"))?;
    Ok(context)
}

/// Mesa draws with a thread for each CPU, of this many at most.
const MOST_DRAWING_THREADS: usize = 16;
/// Of a thread that says nothing of it.
const STACK_BYTES: usize = 8 << 20;

/// Starts as many threads at once as drawing in software does, which end at once.
fn refuse_without_threads() -> Result<(), NoPictures> {
    let count = std::thread::available_parallelism().map_or(1, usize::from).min(MOST_DRAWING_THREADS);
    let gate = Mutex::new(());
    std::thread::scope(|scope| {
        let _shut = gate.lock();
        let wait = || drop(gate.lock());
        let start = |_| std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, wait);
        let started = (0..count).map(start).collect::<io::Result<Vec<_>>>();
        started.map(drop).map_err(|error| NoPictures::Threads(limits::no_thread(&error)))
    })
}

/// For the first colour, on a machine where others work, too.
const TRIAL: Duration = Duration::from_secs(5);

/// Draws in a thread that is left behind if it does not come to an end.
fn refuse_if_stuck() -> Result<(), NoPictures> {
    let (tell, steps) = channel();
    let draw = move || {
        let made = Offscreen::make();
        // Whoever listens has given up otherwise.
        let _ = tell.send(());
        let drawn = made.map(|made| made.draw_a_colour());
        let _ = tell.send(());
        drawn
    };
    let thread = std::thread::Builder::new().name("trial".into()).stack_size(STACK_BYTES).spawn(draw);
    let thread = thread.map_err(|error| NoPictures::Threads(limits::no_thread(&error)))?;
    // To load the library may take its time.
    let is_made = steps.recv().is_ok();
    if is_made && steps.recv_timeout(TRIAL) == Err(RecvTimeoutError::Timeout) {
        return Err(NoPictures::Stuck);
    }
    thread.join().unwrap_or_else(|_| Err(NoPictures::Graphics("the graphics library cannot draw".into())))
}

fn no_library(reason: String) -> NoPictures {
    if reason.contains("No such file") {
        return NoPictures::NoLibrary(reason);
    }
    of_a_limit("cannot be loaded", reason).unwrap_or_else(NoPictures::NoLibrary)
}

fn failed(step: &'static str) -> impl Fn(egl::Error) -> NoPictures {
    move |error| {
        let refused = of_a_limit(step, error.to_string());
        refused.unwrap_or_else(|reason| NoPictures::NoContext { step, reason })
    }
}

/// Failure that a limit of this process has likely caused, or the reason again.
fn of_a_limit(step: &'static str, reason: String) -> Result<NoPictures, String> {
    if let Some(remedy) = missing_files() {
        return Ok(NoPictures::Files { step, reason, remedy });
    }
    match limits::memory_limit() {
        Some(limit) => Ok(NoPictures::Memory { step, reason, limit }),
        None => Err(reason),
    }
}

/// So many files a graphics library has open at once while it is loaded, about.
const MOST_LOADING_FILES: usize = 8;

/// Remedy where this process may not open so many.
fn missing_files() -> Option<String> {
    let opened = (0..MOST_LOADING_FILES).map(|_| File::open("/dev/null")).collect::<io::Result<Vec<_>>>();
    limits::remedy(&opened.err()?)
}

fn name_of(gl: &three_d::context::Context) -> String {
    use three_d::context::HasContext;
    // SAFETY: a question to the context that is current on this thread.
    unsafe { gl.get_parameter_string(three_d::context::RENDERER) }
}
