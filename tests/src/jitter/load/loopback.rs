//! Sends itself packets over 127.0.0.1: soft interrupts and wake-ups, nothing on any wire.

use super::Pace;
use std::net::{Ipv4Addr, UdpSocket};
use std::time::Duration;

/// Bursts a second, packets a burst: 20,000 packets, 28 MB.
const BURSTS: u32 = 1000;
const BURST: usize = 20;
const PACKET: usize = 1400;

pub(super) fn work() -> std::io::Error {
    prepare().map_or_else(|error| error, |(sender, receiver)| exchange(&sender, &receiver))
}

fn prepare() -> std::io::Result<(UdpSocket, UdpSocket)> {
    let [sender, receiver] =
        [UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?, UdpSocket::bind((Ipv4Addr::LOCALHOST, 0))?];
    sender.connect(receiver.local_addr()?)?;
    receiver.connect(sender.local_addr()?)?;
    receiver.set_read_timeout(Some(Duration::from_millis(10)))?;
    Ok((sender, receiver))
}

fn exchange(sender: &UdpSocket, receiver: &UdpSocket) -> std::io::Error {
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut packet = [0; PACKET];
            loop {
                // A packet that was dropped is no reason to stop.
                let _ = receiver.recv(&mut packet);
            }
        });
        let mut pace = Pace::per_second(BURSTS);
        loop {
            for _ in 0..BURST {
                let _ = sender.send(&[0x5A; PACKET]);
            }
            pace.wait();
        }
    })
}
