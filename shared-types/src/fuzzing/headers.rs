//! Headers: 80 bytes, then the payload.

use crate::wire::{Class, FORMAT_VERSION, HEADER_BYTES, Header, Kind, Refusal};
use zerocopy::{FromBytes, IntoBytes};

/// A sealed sample is accepted if version, class and kind exist, refused for that reason else, and
/// never accepted with one bit of it turned round.
pub(super) fn read(bytes: &[u8]) {
    let Ok((mut header, payload)) = Header::read_from_prefix(bytes) else { return };
    let run = header.run;
    let _as_it_came = header.verify(payload, run);
    header.seal(payload);
    let verdict = header.verify(payload, run);
    let meant = if header.format_version == FORMAT_VERSION {
        header.class().zip(header.kind()).ok_or(Refusal::Kind)
    } else {
        Err(Refusal::Version)
    };
    assert_eq!(verdict, meant);
    if verdict.is_err() {
        return;
    }
    assert_eq!(header.verify(payload, !run), Err(Refusal::Foreign));
    let mut sample = [header.as_bytes(), payload].concat();
    let bit = header.checksum as usize % (sample.len() * 8);
    sample[bit / 8] ^= 1 << (bit % 8);
    let (turned, payload) = Header::read_from_prefix(&sample).expect("the sample has a header");
    assert!(turned.verify(payload, run).is_err(), "bit {bit} was turned round");
}

/// One sample of every kind, with and without payload.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let kinds = (0..=u8::MAX).map_while(Kind::from_code);
    let sample = |kind: Kind| {
        let mut header = Header::new(Class::Replication, kind);
        header.run = 7;
        let payload = vec![0xa5; kind as usize * 3];
        header.seal(&payload);
        let sample = [header.as_bytes(), &payload].concat();
        assert!(sample.len() >= HEADER_BYTES);
        sample
    };
    kinds.map(sample).collect()
}
