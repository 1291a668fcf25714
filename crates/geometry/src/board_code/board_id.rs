use std::{fmt, str::FromStr};

/// Digits and letters not mistaken for each other.
const ALPHABET: &[u8; 32] = b"0123456789ABCDEFGHJKMNPQRSTVWXYZ";
const LETTERS: usize = 4;
const BITS_OF_LETTER: u32 = 5;

/// Identity of a printed board: four digits or letters, without I, L, O and U.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BoardId(u32);

/// Error of a text that isn't a [`BoardId`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected four digits or letters other than U, for example K7Q2")]
pub struct NotAnId;

impl BoardId {
    /// Number of bits in an ID.
    pub const BITS: u32 = LETTERS as u32 * BITS_OF_LETTER;

    /// Makes an ID from the last bits of a number.
    pub fn from_number(number: u32) -> Self {
        Self(number & ((1 << Self::BITS) - 1))
    }

    /// Value of the ID, below 2²⁰.
    pub fn number(self) -> u32 {
        self.0
    }
}

impl fmt::Display for BoardId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (0..LETTERS as u32).rev().try_for_each(|place| {
            let letter = self.0 >> (place * BITS_OF_LETTER) & 31;
            write!(f, "{}", char::from(ALPHABET[letter as usize]))
        })
    }
}

impl FromStr for BoardId {
    type Err = NotAnId;

    fn from_str(text: &str) -> Result<Self, NotAnId> {
        if text.chars().count() != LETTERS {
            return Err(NotAnId);
        }
        let number = text.chars().try_fold(0, |number: u32, letter| {
            let letter = match letter.to_ascii_uppercase() {
                'O' => '0',
                'I' | 'L' => '1',
                letter => letter,
            };
            let place = ALPHABET.iter().position(|known| char::from(*known) == letter)?;
            Some(number << BITS_OF_LETTER | place as u32)
        });
        number.map(Self).ok_or(NotAnId)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_read_as_they_are_written_and_as_they_are_misheard() {
        for number in [0, 1, 31, 32, 0x5_1234, (1 << 20) - 1] {
            let id = BoardId::from_number(number);
            assert_eq!(id.to_string().parse(), Ok(id));
            assert_eq!(id.number(), number);
        }
        assert_eq!("k7q2".parse::<BoardId>().map(|id| id.to_string()), Ok("K7Q2".into()));
        assert_eq!("OIL0".parse::<BoardId>().map(|id| id.to_string()), Ok("0110".into()));
        for wrong in ["", "K7Q", "K7Q22", "K7U2", "K-Q2", "Ä7Q2"] {
            assert_eq!(wrong.parse::<BoardId>(), Err(NotAnId), "{wrong}");
        }
    }
}
