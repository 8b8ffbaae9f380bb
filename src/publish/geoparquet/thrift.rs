//! Thrift's compact protocol, as much of it as Parquet's metadata needs.

/// A struct being written: fields in ascending order of their ids.
#[derive(Default)]
pub(super) struct Struct {
    bytes: Vec<u8>,
    last: u8,
}

/// Types of the compact protocol.
const TRUE: u8 = 1;
const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

impl Struct {
    /// A struct without fields.
    pub(super) fn new() -> Self {
        Self::default()
    }

    /// A field that is true.
    pub(super) fn yes(mut self, id: u8) -> Self {
        self.field(id, TRUE);
        self
    }

    /// A 32-bit field, or an enum's.
    pub(super) fn i32(mut self, id: u8, value: i32) -> Self {
        self.field(id, I32);
        zigzag(&mut self.bytes, i64::from(value));
        self
    }

    /// A 64-bit field.
    pub(super) fn i64(mut self, id: u8, value: i64) -> Self {
        self.field(id, I64);
        zigzag(&mut self.bytes, value);
        self
    }

    /// A text's or bytes' field.
    pub(super) fn binary(mut self, id: u8, value: &[u8]) -> Self {
        self.field(id, BINARY);
        binary(&mut self.bytes, value);
        self
    }

    /// A struct's field.
    pub(super) fn nested(mut self, id: u8, value: Self) -> Self {
        self.field(id, STRUCT);
        self.bytes.extend(value.finish());
        self
    }

    /// A list of structs.
    pub(super) fn structs(mut self, id: u8, values: Vec<Self>) -> Self {
        self.list(id, STRUCT, values.len());
        for value in values {
            self.bytes.extend(value.finish());
        }
        self
    }

    /// A list of enums.
    pub(super) fn i32s(mut self, id: u8, values: &[i32]) -> Self {
        self.list(id, I32, values.len());
        for &value in values {
            zigzag(&mut self.bytes, i64::from(value));
        }
        self
    }

    /// A list of texts.
    pub(super) fn texts(mut self, id: u8, values: &[&str]) -> Self {
        self.list(id, BINARY, values.len());
        for value in values {
            binary(&mut self.bytes, value.as_bytes());
        }
        self
    }

    /// The struct's bytes.
    pub(super) fn finish(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }

    /// A field's head: how far its id is from the last one's, which Parquet keeps below 16.
    fn field(&mut self, id: u8, kind: u8) {
        let step = id - self.last;
        debug_assert!((1..16).contains(&step), "fields in ascending order");
        self.bytes.push((step << 4) | kind);
        self.last = id;
    }

    fn list(&mut self, id: u8, kind: u8, length: usize) {
        self.field(id, LIST);
        match u8::try_from(length) {
            Ok(short) if short < 15 => self.bytes.push((short << 4) | kind),
            _ => {
                self.bytes.push(0xf0 | kind);
                varint(&mut self.bytes, length as u64);
            }
        }
    }
}

/// A number seven bits at a time, the lowest first.
pub(super) fn varint(out: &mut Vec<u8>, mut value: u64) {
    loop {
        let low = value.to_le_bytes()[0] & 0x7f;
        value >>= 7;
        if value == 0 {
            out.push(low);
            return;
        }
        out.push(low | 0x80);
    }
}

fn zigzag(out: &mut Vec<u8>, value: i64) {
    varint(out, ((value << 1) ^ (value >> 63)).cast_unsigned());
}

fn binary(out: &mut Vec<u8>, value: &[u8]) {
    varint(out, value.len() as u64);
    out.extend(value);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Worked by hand from the protocol's specification.
    #[test]
    fn bytes_are_those_of_the_compact_protocol() {
        let inner = Struct::new().i32(1, -1);
        let bytes = Struct::new()
            .i32(1, 300)
            .binary(3, b"ab")
            .yes(4)
            .nested(6, inner)
            .i32s(7, &[0, 3])
            .finish();
        let expected = [
            0x15, 0xd8, 0x04, 0x28, 2, b'a', b'b', 0x11, 0x2c, 0x15, 0x01, 0, 0x19, 0x25, 0, 6, 0,
        ];
        assert_eq!(bytes, expected);
        let long = Struct::new().i32s(1, &[1; 20]).finish();
        assert_eq!(long[..3], [0x19, 0xf5, 20]);
    }
}
