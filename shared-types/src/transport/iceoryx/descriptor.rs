//! Borrowing the descriptor that a listener sleeps on. The only unsafe code of the transport:
//! iceoryx2 gives a raw number, and a wait with a deadline needs it as a borrowed descriptor.
#![expect(unsafe_code, reason = "iceoryx2 lends a listener's descriptor as a raw number only")]

use super::Listener;
use iceoryx2::prelude::FileDescriptorBased;
use std::os::fd::BorrowedFd;

/// The descriptor that becomes readable when the bell of `listener` rings.
pub(super) fn of(listener: &Listener) -> BorrowedFd<'_> {
    // SAFETY: reading the number is harmless; closing it would not be, and nobody here does.
    let number = unsafe { listener.file_descriptor().native_handle() };
    // SAFETY: the listener owns the descriptor and keeps it open until it is dropped, which the
    // lifetime of the borrow excludes.
    unsafe { BorrowedFd::borrow_raw(number) }
}
