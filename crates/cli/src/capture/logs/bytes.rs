//! Numbers and texts out of bytes, each looked for before it is taken.

/// What is left of a message or record; little-endian, unless told.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bytes<'a> {
    rest: &'a [u8],
    /// Bytes taken so far.
    taken: usize,
    is_big_endian: bool,
}

macro_rules! number {
    ($name:ident, $type:ty) => {
        /// The next number.
        pub fn $name(&mut self) -> Option<$type> {
            let bytes = self.take(size_of::<$type>())?.try_into().ok()?;
            Some(if self.is_big_endian {
                <$type>::from_be_bytes(bytes)
            } else {
                <$type>::from_le_bytes(bytes)
            })
        }
    };
}

impl<'a> Bytes<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self {
            rest: bytes,
            taken: 0,
            is_big_endian: false,
        }
    }

    /// The same, big-endian or not.
    pub fn with_order(self, is_big_endian: bool) -> Self {
        Self {
            is_big_endian,
            ..self
        }
    }

    number!(u8, u8);
    number!(u16, u16);
    number!(u32, u32);
    number!(u64, u64);
    number!(i32, i32);
    number!(f64, f64);

    /// All that is left.
    pub fn rest(self) -> &'a [u8] {
        self.rest
    }

    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        self.taken += count;
        Some(taken)
    }

    /// Goes on to the next multiple of `to` from the beginning.
    pub fn align(&mut self, to: usize) -> Option<()> {
        self.take(self.taken.next_multiple_of(to) - self.taken)?;
        Some(())
    }

    /// Bytes after their number, a u32.
    pub fn counted(&mut self) -> Option<&'a [u8]> {
        let count = self.u32()?;
        self.take(usize::try_from(count).ok()?)
    }

    /// A text after its number of bytes; what is not UTF-8 is shown as such.
    pub fn text(&mut self) -> Option<String> {
        Some(String::from_utf8_lossy(self.counted()?).into_owned())
    }
}
