//! The same link over Unix datagram sockets: what two processes use who know nothing better.
//!
//! Every process binds one socket in the area's directory and connects one more to each peer, so that
//! no path is looked up while measuring. A datagram is the plain header and the payload in one piece.
//! The kernel queues few datagrams per socket (`net.unix.max_dgram_qlen`); who finds a queue full
//! takes in its own meanwhile, so that processes cannot wait for each other in a circle.

use super::RawError;
use super::area::AreaName;
use super::link::{Link, Peers};
use super::port::{PAYLOAD_BYTES, SampleHeader, low_byte};
use std::collections::VecDeque;
use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;

const HEADER_BYTES: usize = size_of::<SampleHeader>();
const DATAGRAM_BYTES: usize = HEADER_BYTES + PAYLOAD_BYTES;

/// What a process does until a datagram arrives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Waiting {
    /// Looks again after a `sched_yield`.
    Poll,
    /// Sleeps in the receiving call. Only for two processes that take turns.
    Block,
}

/// One process's sockets.
#[derive(Debug)]
pub struct DatagramLink {
    waiting: Waiting,
    own: UnixDatagram,
    peers: Vec<UnixDatagram>,
    /// Taken in while a peer's queue was full.
    early: VecDeque<SampleHeader>,
}

impl DatagramLink {
    /// Binds the socket of process `index`.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn bind(area: &AreaName, index: u32, waiting: Waiting) -> Result<Self, RawError> {
        let own = UnixDatagram::bind(area.socket(index))
            .and_then(|own| own.set_nonblocking(waiting == Waiting::Poll).map(|()| own))
            .map_err(RawError::process("bind a socket"))?;
        Ok(Self { waiting, own, peers: Vec::new(), early: VecDeque::new() })
    }

    /// Connects to every process of `peers`; their sockets must be bound.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn connect(
        &mut self,
        area: &AreaName,
        peers: impl IntoIterator<Item = u32>,
    ) -> Result<(), RawError> {
        for peer in peers {
            let socket = UnixDatagram::unbound()
                .and_then(|socket| socket.connect(area.socket(peer)).map(|()| socket))
                .and_then(|socket| {
                    socket.set_nonblocking(self.waiting == Waiting::Poll).map(|()| socket)
                })
                .map_err(RawError::process("connect a socket"))?;
            self.peers.push(socket);
        }
        Ok(())
    }

    /// The header of the next datagram of the own socket.
    #[inline]
    fn take(&self) -> Result<Option<SampleHeader>, RawError> {
        let mut datagram = [0; DATAGRAM_BYTES];
        match self.own.recv(&mut datagram) {
            Ok(DATAGRAM_BYTES) => read(&datagram).map(Some),
            Ok(length) => Err(RawError::Unexpected(format!("datagram of {length} bytes"))),
            Err(error) if is_transient(error.kind()) => Ok(None),
            Err(source) => Err(RawError::Process { operation: "receive a datagram", source }),
        }
    }
}

impl Link for DatagramLink {
    #[inline]
    fn send(&mut self, header: SampleHeader) -> Result<(), RawError> {
        let datagram = write(header);
        for peer in 0..self.peers.len() {
            loop {
                match self.peers[peer].send(&datagram) {
                    Ok(_) => break,
                    Err(error) if is_transient(error.kind()) => match self.take()? {
                        Some(header) => self.early.push_back(header),
                        None => std::thread::yield_now(),
                    },
                    Err(source) => {
                        return Err(RawError::Process { operation: "send a datagram", source });
                    }
                }
            }
        }
        Ok(())
    }

    #[inline]
    fn receive(&mut self) -> Result<Option<SampleHeader>, RawError> {
        match self.early.pop_front() {
            Some(header) => Ok(Some(header)),
            None => self.take(),
        }
    }
}

impl Peers for DatagramLink {
    #[inline]
    fn try_send(&mut self, peer: usize, header: SampleHeader) -> Result<bool, RawError> {
        match self.peers[peer].send(&write(header)) {
            Ok(_) => Ok(true),
            Err(error) if is_transient(error.kind()) => Ok(false),
            Err(source) => Err(RawError::Process { operation: "send a datagram", source }),
        }
    }

    #[inline]
    fn receive(&mut self) -> Result<Option<SampleHeader>, RawError> {
        self.take()
    }
}

/// Whether the call is to be made again.
fn is_transient(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// The datagram of `header`, filled with the low byte of its number.
fn write(header: SampleHeader) -> [u8; DATAGRAM_BYTES] {
    let mut datagram = [low_byte(header.number); DATAGRAM_BYTES];
    datagram[..4].copy_from_slice(&header.source.to_le_bytes());
    datagram[4..8].copy_from_slice(&header.number.to_le_bytes());
    datagram[8..HEADER_BYTES].copy_from_slice(&header.published_ns.to_le_bytes());
    datagram
}

/// The header of `datagram`, whose payload must be what the header says.
fn read(datagram: &[u8; DATAGRAM_BYTES]) -> Result<SampleHeader, RawError> {
    let word = |at: usize| std::array::from_fn(|byte| datagram[at + byte]);
    let header = SampleHeader {
        source: u32::from_le_bytes(word(0)),
        number: u32::from_le_bytes(word(4)),
        published_ns: u64::from_le_bytes(std::array::from_fn(|byte| datagram[8 + byte])),
    };
    if datagram.last() == Some(&low_byte(header.number)) {
        Ok(header)
    } else {
        Err(RawError::Unexpected(format!("payload with {header:?}")))
    }
}

#[cfg(test)]
mod tests {
    use super::{read, write};
    use crate::raw::port::SampleHeader;

    #[test]
    fn a_header_is_read_as_it_was_written() {
        let header = SampleHeader { source: 7, number: 0x1_0203, published_ns: 1 << 40 };
        assert_eq!(read(&write(header)).unwrap(), header);
    }

    #[test]
    fn a_payload_of_another_number_is_refused() {
        let mut datagram = write(SampleHeader { source: 0, number: 5, published_ns: 0 });
        datagram[4] += 1;
        assert!(read(&datagram).is_err());
    }
}
