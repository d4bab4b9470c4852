//! MCAP files record by record, as other programs and damage make them.

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
pub(super) const CHANNEL: u8 = 0x04;
pub(super) const MESSAGE: u8 = 0x05;
pub(super) const CHUNK: u8 = 0x06;
pub(super) const ATTACHMENT: u8 = 0x09;
pub(super) const METADATA: u8 = 0x0c;
pub(super) const DATA_END: u8 = 0x0f;

/// A file of these records.
pub(super) fn file(records: impl IntoIterator<Item = Vec<u8>>) -> Vec<u8> {
    let all: Vec<u8> = records.into_iter().flatten().collect();
    [MAGIC, &all, MAGIC].concat()
}

/// The records of a sound file: opcode and content.
pub(super) fn records(file: &[u8]) -> Vec<(u8, &[u8])> {
    let mut rest = &file[MAGIC.len()..file.len() - MAGIC.len()];
    let mut all = Vec::new();
    while let Some((head, behind)) = rest.split_at_checked(9) {
        let length = u64::from_le_bytes(head[1..].try_into().expect("8 bytes")) as usize;
        let (body, next) = behind.split_at(length);
        all.push((head[0], body));
        rest = next;
    }
    all
}

pub(super) fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode][..], &(body.len() as u64).to_le_bytes(), body].concat()
}

pub(super) fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// With these times, and this length of its records before they were compressed.
pub(super) fn chunk(times: &[u8], length: u64, compression: &str, records: &[u8]) -> Vec<u8> {
    let stored = (records.len() as u64).to_le_bytes();
    let body = [times, &length.to_le_bytes(), &[0; 4], &text(compression), &stored, records].concat();
    record(CHUNK, &body)
}

/// Records as they are.
pub(super) fn plain_chunk(records: &[u8]) -> Vec<u8> {
    chunk(&[0; 16], records.len() as u64, "", records)
}

pub(super) fn attachment(name: &str, data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    record(ATTACHMENT, &[&[0; 16], &text(name)[..], &text(""), &length, data, &[0; 4]].concat())
}
