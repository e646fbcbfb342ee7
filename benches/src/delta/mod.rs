//! Slateswarm's own delta path in the protocol of the raw programs: half a round trip between two
//! processes, from a firing at one craft to the merged fact on the other's board.
//!
//! Everything is the product's: run root, services, endpoint, header, checksum, sequence, boards,
//! strategy `boundary`, dispatch. A way is: draw a candidate, fire, plan, write into the loan, send;
//! then at the peer receive, verify, decode, hold, close the turn, merge and update the rules that
//! read the fact. Two things replace the orchestrator's loop: a craft's turns are opened by the
//! arrival of the peer's delta ([`exchange`]), and the processes are the raw programs' children,
//! with their start barrier and pinning ([`one_way`]). Both stamps of a sample are taken: when the
//! change was made and when send was called.

pub mod exchange;
pub mod one_way;
