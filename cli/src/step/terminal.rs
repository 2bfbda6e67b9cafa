//! Keys of a terminal, one at a time. The terminal is back in its own mode while the program prints, after it ended, and if a signal ends it.

use crate::step::Key;
use rustix::termios::{
    LocalModes, OptionalActions, SpecialCodeIndex, Termios, tcgetattr, tcsetattr,
};
use std::io::{self, Read as _};
use std::sync::{Mutex, PoisonError};

/// The mode of the terminal before it was changed; `None` if it is not changed now.
static OWN: Mutex<Option<Termios>> = Mutex::new(None);

/// Gives the terminal its own mode back, if it was changed.
pub(crate) fn restore() {
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(mode) = own.take() {
        // If this fails there is no terminal any more.
        let _ = tcsetattr(io::stdin(), OptionalActions::Now, &mode);
    }
}

/// Keys from standard input, which is a terminal.
pub(crate) struct Keys {
    /// Bytes that were read and not used yet.
    bytes: Vec<u8>,
}

impl Keys {
    /// Prepares for keys. Signals that end the program restore the terminal first.
    pub(crate) fn new() -> Self {
        use signal_hook::consts::{SIGHUP, SIGQUIT, SIGTERM};
        if let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGTERM, SIGHUP, SIGQUIT]) {
            let wait = move || {
                if let Some(signal) = signals.forever().next() {
                    restore();
                    let _ = signal_hook::low_level::emulate_default_handler(signal);
                }
            };
            let _ = std::thread::Builder::new().name("terminal".to_owned()).spawn(wait);
        }
        Keys { bytes: Vec::new() }
    }

    /// Waits for a key; `None` at the end of the input. The terminal shows no keys and delivers each at once meanwhile; Ctrl-C and Ctrl-Z work as usual.
    ///
    /// # Errors
    /// The error of the system.
    pub(crate) fn next(&mut self) -> io::Result<Option<Key>> {
        while self.bytes.is_empty() {
            let mut some = [0; 64];
            change()?;
            let read = io::stdin().lock().read(&mut some);
            restore();
            match read {
                Ok(0) => return Ok(None),
                Ok(n) => self.bytes.extend(&some[..n]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        let (key, used) = key(&self.bytes);
        self.bytes.drain(..used);
        Ok(Some(key))
    }
}

fn change() -> io::Result<()> {
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    let mode = tcgetattr(io::stdin())?;
    let mut keys = mode.clone();
    keys.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
    keys.special_codes[SpecialCodeIndex::VMIN] = 1;
    keys.special_codes[SpecialCodeIndex::VTIME] = 0;
    tcsetattr(io::stdin(), OptionalActions::Now, &keys)?;
    *own = Some(mode);
    Ok(())
}

/// The first key of some bytes, and how many of them it has.
fn key(bytes: &[u8]) -> (Key, usize) {
    match bytes {
        [0x1b, b'[' | b'O', rest @ ..] => {
            // The end of a control sequence is its first byte from `@` on.
            let n_before = rest.iter().take_while(|byte| !(0x40..=0x7e).contains(*byte)).count();
            let key = match rest.get(n_before) {
                Some(b'C') => Key::Right,
                Some(b'D') => Key::Left,
                _ => Key::Other,
            };
            (key, bytes.len().min(2 + n_before + 1))
        }
        [b'\r' | b'\n', ..] => (Key::Char('\n'), 1),
        [4, ..] => (Key::End, 1),
        [byte @ 0x20..=0x7e, ..] => (Key::Char(char::from(*byte)), 1),
        _ => (Key::Other, 1),
    }
}

#[cfg(test)]
mod tests {
    use super::key;
    use crate::step::Key;

    #[test]
    fn bytes_become_keys() {
        assert_eq!(key(b" x"), (Key::Char(' '), 1));
        assert_eq!(key(b"\r"), (Key::Char('\n'), 1));
        assert_eq!(key(b"\x1b[Dq"), (Key::Left, 3));
        assert_eq!(key(b"\x1bOCq"), (Key::Right, 3));
        assert_eq!(key(b"\x1b[1;5Dq"), (Key::Left, 6));
        assert_eq!(key(b"\x1b[200~q"), (Key::Other, 6));
        assert_eq!(key(b"\x1b["), (Key::Other, 2));
        assert_eq!(key(b"\x04"), (Key::End, 1));
        assert_eq!(key("é".as_bytes()), (Key::Other, 1));
    }
}
