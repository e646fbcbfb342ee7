//! Counters in a file that several processes map: the only unsafe code of heartbeats.
#![expect(
    unsafe_code,
    reason = "mapping a file is a promise about memory that the compiler cannot see"
)]

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use std::fs::File;
use std::io;
use std::ptr::{NonNull, null_mut};
use std::sync::atomic::AtomicU64;

/// A counter with a cache line of its own. Atomics throughout: other processes write here.
#[repr(C, align(64))]
struct Line {
    count: AtomicU64,
    _unused: [AtomicU64; 7],
}

/// Bytes of one counter.
pub(super) const LINE_BYTES: usize = size_of::<Line>();

/// The first counters of a file.
#[derive(Debug)]
pub(super) struct Mapping {
    start: NonNull<Line>,
    lines: usize,
}

impl Mapping {
    /// The first `lines` counters of `file`, which nobody may make shorter.
    pub(super) fn of(file: &File, lines: usize) -> io::Result<Self> {
        let (there, needed) = (file.metadata()?.len(), lines * LINE_BYTES);
        if there < needed as u64 {
            return Err(io::Error::other(format!("{there} bytes, {needed} are needed")));
        }
        let (access, flags) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED);
        // SAFETY: the kernel chooses a place that nothing else has, and nothing refers to it yet.
        let start = unsafe { mmap(null_mut(), needed, access, flags, file, 0) }?;
        let start = NonNull::new(start.cast()).expect("invariant: nothing is mapped at zero");
        Ok(Self { start, lines })
    }

    /// Counter `place`.
    #[inline]
    pub(super) fn counter(&self, place: usize) -> &AtomicU64 {
        assert!(place < self.lines, "invariant: every process has a place");
        // SAFETY: `place` lies in the mapping, which is aligned to pages and lives as long as `self`; any
        // bytes are a valid line, and whoever else maps the file reads and writes it atomically, too.
        let line = unsafe { self.start.add(place).as_ref() };
        &line.count
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: the range is the one that was mapped, and every borrow of it has ended. What the kernel
        // refuses stays mapped and harms nobody.
        let _unmapped = unsafe { munmap(self.start.as_ptr().cast(), self.lines * LINE_BYTES) };
    }
}
