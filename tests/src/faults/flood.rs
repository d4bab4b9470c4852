//! Clients that connect ten thousand times a second, each to be a burden of its own kind.

use patience::BoundedThread;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};
use shm_abi::handshake::{Request, RequestKind};
use std::collections::VecDeque;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const THREADS: u64 = 4;
/// Connections that each thread keeps open, the youngest.
const KEPT: usize = 100;

/// It goes on until it is dropped.
#[derive(Debug)]
pub struct Flood {
    stop: Arc<AtomicBool>,
    attempts: Arc<AtomicU64>,
    threads: Vec<JoinHandle<()>>,
}

impl Flood {
    /// So many attempts a second at this socket.
    pub fn start(socket: &Path, per_second: u64) -> Self {
        let (stop, attempts) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let thread = |_| {
            let (socket, stop, attempts) = (socket.to_path_buf(), Arc::clone(&stop), Arc::clone(&attempts));
            std::thread::spawn(move || attack(&socket, per_second / THREADS, &stop, &attempts))
        };
        let threads = (0..THREADS).map(thread).collect();
        Self { stop, attempts, threads }
    }

    /// Attempts made so far.
    pub fn attempts(&self) -> u64 {
        self.attempts.load(Ordering::Relaxed)
    }
}

impl Drop for Flood {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.threads.drain(..).for_each(|thread| drop(thread.bounded_join()));
    }
}

fn attack(socket: &Path, per_second: u64, stop: &AtomicBool, attempts: &AtomicU64) {
    let address = SocketAddrUnix::new(socket).expect("a short name");
    let mut kept = VecDeque::new();
    let (begun, mut made) = (Instant::now(), 0);
    while !stop.load(Ordering::Relaxed) {
        let due = (begun.elapsed().as_secs_f64() * per_second as f64) as u64;
        while made < due {
            kept.extend(burden(&address, made));
            kept.drain(..kept.len().saturating_sub(KEPT));
            made += 1;
            attempts.fetch_add(1, Ordering::Relaxed);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Silent, half a request, garbage, or a request whose answer is never fetched; a full queue of newcomers is an attempt, too.
fn burden(address: &SocketAddrUnix, number: u64) -> Option<UnixStream> {
    let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
    let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None).ok()?;
    connect(&socket, address).ok()?;
    let mut stream = UnixStream::from(socket);
    let kind = if number.is_multiple_of(8) { RequestKind::Observe } else { RequestKind::EndLease };
    let request = Request::new(kind, "flood");
    let bytes = bytemuck::bytes_of(&request);
    let _ = match number % 4 {
        0 => stream.write_all(bytes),
        1 => stream.write_all(&bytes[..bytes.len() / 2]),
        2 => stream.write_all(&[0x5a; 300]),
        _ => Ok(()),
    };
    Some(stream)
}
