//! A craft that kills itself, or falls silent or deaf, where it was told to, so that what follows can be seen.
//!
//! A [`Doom`] comes on the craft's command line and is obeyed, with SIGKILL but for two: at a point of
//! the craft's life that is named, not at an instant that somebody guessed from outside. [`Doomed`]
//! wraps the endpoint of such a craft and of no other, so that a craft without a doom runs the code that
//! it always runs. Not here: who is doomed to what (the orchestrator's campaigns).

use shared_types::ids::CraftId;
use shared_types::transport::link::StatedLink;
use shared_types::transport::sequence::Sequences;
use shared_types::transport::{
    Destination, Endpoint, Numbered, Peers, SendError, WorldSample, clock,
};
use shared_types::wire::{Header, Losses};
use std::fmt;
use std::str::FromStr;

/// Where a craft kills itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Point {
    /// Its first act.
    StartUp,
    /// Some microseconds after it began to open its services.
    Opening,
    /// While it writes into a loan of shared memory.
    Loan,
    /// After a sample was sent and before its receivers are woken.
    Send,
    /// While it reads a sample where it lies.
    Receive,
    /// As it is told to connect to the others: for a successor, in the middle of its restart.
    Handshake,
    /// Some microseconds after it began to drop its ports.
    Shutdown,
    /// While it reads a sample where it lies it loops for ever, as on what somebody else never finished.
    Silence,
    /// From there on it hears nothing, and goes round all the same.
    Deafness,
}

impl Point {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::StartUp,
        Self::Opening,
        Self::Loan,
        Self::Send,
        Self::Receive,
        Self::Handshake,
        Self::Shutdown,
        Self::Silence,
        Self::Deafness,
    ];

    /// The name on command lines and in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::StartUp => "start-up",
            Self::Opening => "opening",
            Self::Loan => "loan",
            Self::Send => "send",
            Self::Receive => "receive",
            Self::Handshake => "handshake",
            Self::Shutdown => "shutdown",
            Self::Silence => "silence",
            Self::Deafness => "deafness",
        }
    }
}

/// Where a craft kills itself, and after how much.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Doom {
    /// Where.
    pub point: Point,
    /// Of loans, sends, receptions, silence and deafness: how many are let pass before. Of opening and
    /// shutdown: how many microseconds. Else nothing.
    pub after: u32,
}

impl Doom {
    /// Obeys, if this is the place: the process is gone then.
    pub fn strike_at(self, point: Point) {
        if self.point == point {
            self.strike();
        }
    }

    /// Obeys some microseconds from now, if this is the place, whatever the process does by then.
    pub fn strike_soon_after(self, point: Point) {
        if self.point != point {
            return;
        }
        let instant = clock::now().plus(u64::from(self.after) * 1_000);
        std::thread::spawn(move || {
            while clock::now() < instant {
                rustix::thread::sched_yield();
            }
            self.strike();
        });
    }

    /// Says what happens and kills the process, or never goes on.
    fn strike(self) {
        if self.point == Point::Silence {
            loop {
                rustix::thread::sched_yield();
            }
        }
        eprintln!("{}", self.last_words());
        super::startup::kill_this_process();
    }

    /// What a doomed craft says on standard error; [`Self::died_at`] reads it.
    fn last_words(self) -> String {
        format!("{LAST_WORDS}{self} at {} ns", clock::now().0)
    }

    /// When a craft that said `said` obeyed its doom, ns of the monotonic clock; `None` if it did not.
    #[must_use]
    pub fn died_at(said: &str) -> Option<u64> {
        let words = said.lines().find_map(|line| line.strip_prefix(LAST_WORDS))?;
        words.strip_suffix(" ns")?.rsplit(' ').next()?.parse().ok()
    }
}

/// How the last words of a doomed craft begin.
const LAST_WORDS: &str = "slateswarm: dies as it was told: ";

impl fmt::Display for Doom {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.point.name(), self.after)
    }
}

impl FromStr for Doom {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || format!("`{text}` is no point and number, such as `send:3`");
        let (name, after) = text.split_once(':').ok_or_else(wrong)?;
        let point = Point::ALL.into_iter().find(|point| point.name() == name).ok_or_else(wrong)?;
        Ok(Self { point, after: after.parse().map_err(|_| wrong())? })
    }
}

/// The endpoint of a craft with a doom.
#[derive(Debug)]
pub struct Doomed<E> {
    inner: E,
    doom: Doom,
    /// Loans, sends or receptions that are still let pass.
    left: u32,
}

impl<E> Doomed<E> {
    /// `inner` in the hands of a craft with this doom.
    pub const fn new(inner: E, doom: Doom) -> Self {
        Self { inner, doom, left: doom.after }
    }

    /// The endpoint itself.
    pub const fn inner_mut(&mut self) -> &mut E {
        &mut self.inner
    }
}

/// Obeys a doom at `point` once as many as it says have passed.
fn pass(doom: Doom, left: &mut u32, point: Point) {
    if doom.point == point {
        match left.checked_sub(1) {
            Some(fewer) => *left = fewer,
            None => doom.strike(),
        }
    }
}

/// Whether a craft with this doom hears no more: it heard as many samples as it says.
const fn is_deaf(doom: Doom, left: &mut u32) -> bool {
    if !matches!(doom.point, Point::Deafness) {
        return false;
    }
    let is_deaf = *left == 0;
    *left = left.saturating_sub(1);
    is_deaf
}

impl<E: Endpoint> Endpoint for Doomed<E> {
    fn open_ports(&mut self, peers: &Peers) -> Result<(), SendError> {
        self.inner.open_ports(peers)
    }

    fn update_connections(&mut self) -> Result<(), SendError> {
        self.doom.strike_at(Point::Handshake);
        self.inner.update_connections()
    }

    fn send(
        &mut self,
        to: Destination,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        let Self { inner, doom, left } = self;
        let sent = inner.send(to, header, length, &mut |slot| {
            write(slot);
            pass(*doom, left, Point::Loan);
        });
        pass(*doom, left, Point::Send);
        sent
    }

    fn take_world(&mut self) -> Result<Option<WorldSample>, SendError> {
        self.inner.take_world()
    }

    fn flush(&mut self) -> Result<usize, SendError> {
        self.inner.flush()
    }

    fn discard(&mut self, craft: CraftId) -> usize {
        self.inner.discard(craft)
    }

    fn holds_back(&self, to: Destination) -> bool {
        self.inner.holds_back(to)
    }

    fn drain(
        &mut self,
        visit: &mut dyn FnMut(Destination, &Header, &[u8]),
    ) -> Result<usize, SendError> {
        let Self { inner, doom, left } = self;
        inner.drain(&mut |to, header, payload| {
            pass(*doom, left, Point::Receive);
            pass(*doom, left, Point::Silence);
            if !is_deaf(*doom, left) {
                visit(to, header, payload);
            }
        })
    }

    fn next_number(&self, to: Destination) -> u64 {
        self.inner.next_number(to)
    }

    fn send_past_numbering(
        &mut self,
        receiver: CraftId,
        header: Header,
        length: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<(), SendError> {
        self.inner.send_past_numbering(receiver, header, length, write)
    }

    fn numbers(&mut self, service: Numbered) -> &mut Sequences {
        self.inner.numbers(service)
    }

    fn ring(&mut self) {
        self.inner.ring();
    }

    fn expose(&mut self, link: Option<StatedLink>) {
        self.inner.expose(link);
    }

    fn take_losses(&mut self) -> Losses {
        self.inner.take_losses()
    }
}

impl<E> Drop for Doomed<E> {
    fn drop(&mut self) {
        self.doom.strike_soon_after(Point::Shutdown);
    }
}

#[cfg(test)]
mod tests {
    use super::{Doom, LAST_WORDS, Point, pass};

    #[test]
    fn a_doom_reads_as_it_is_written() {
        for point in Point::ALL {
            let doom = Doom { point, after: 17 };
            assert_eq!(doom.to_string().parse(), Ok(doom));
        }
        for wrong in ["", "send", "send:", "send:-1", "sleep:3"] {
            assert!(wrong.parse::<Doom>().is_err_and(|error| error.contains("send:3")));
        }
    }

    #[test]
    fn the_last_words_tell_when_and_other_words_tell_nothing() {
        let doom = Doom { point: Point::Loan, after: 2 };
        let said = format!("a warning\n{}\n", doom.last_words());
        assert!(Doom::died_at(&said).is_some_and(|died| died > 0));
        assert_eq!(Doom::died_at("a warning\n"), None);
        assert_eq!(Doom::died_at(&format!("{LAST_WORDS}send:3 at dawn")), None);
    }

    #[test]
    fn other_points_are_passed() {
        let doom = Doom { point: Point::Loan, after: 2 };
        let mut left = doom.after;
        pass(doom, &mut left, Point::Send);
        assert_eq!(left, 2);
        pass(doom, &mut left, Point::Loan);
        assert_eq!(left, 1);
        doom.strike_at(Point::Receive);
        doom.strike_soon_after(Point::Shutdown);
    }
}
