//! Random charts: nested sequences, alternatives, parallels and loops, half of them with links that fit no structure. A third has hierarchy, forcing orders, a
//! second chart, instances of a library chart, and long or odd names and comments too.

use std::fmt::Write as _;
use std::slice::from_ref;

struct Chart {
    random: u64,
    /// The names of the steps, as they are written.
    names: Vec<String>,
    /// True if it has hierarchy, forcing orders, a second chart, a library chart, and odd names.
    is_rich: bool,
    steps: String,
    transitions: String,
    is_first: bool,
}

/// A random chart, the same for the same seed.
pub(crate) fn random_chart(seed: u64) -> String {
    let mut chart = Chart {
        random: seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1,
        names: Vec::new(),
        is_rich: seed % 3 == 2,
        steps: String::new(),
        transitions: String::new(),
        is_first: true,
    };
    for _ in 0..=chart.below(2) {
        chart.is_first = true;
        let first = chart.step();
        let last = chart.block(&first, 3);
        chart.transition(&[last], &[first]);
    }
    if seed % 2 == 1 {
        for _ in 0..=chart.below(4) {
            let mut some = |n: usize| -> Vec<String> {
                let mut all: Vec<String> = (0..n).map(|_| chart.known_step()).collect();
                all.sort();
                all.dedup();
                all
            };
            let sources = 1 + (seed / 2 % 3) as usize;
            let (from, to) = (some(sources), some(1 + (seed / 6 % 3) as usize));
            let (from, to) = if seed % 7 == 1 { (Vec::new(), to) } else { (from, to) };
            chart.transition(&from, &to);
        }
    }
    let (library, more, other) = if chart.is_rich { (LIBRARY, MORE, OTHER) } else { ("", "", "") };
    format!(
        "{library}chart random {{\n input a, b, c\n output X, Y, Z\n var n: int 0..9\n{more}{}{}}}\n{other}",
        chart.steps, chart.transitions
    )
}

/// The declarations and the macro of a chart with everything.
const MORE: &str = " event E, F
 output `valve.left`, `first.left`
 input `door.is.open`
 const LIMIT = 3 s
 extern action go()
 use belt as first(start = a and not b, run -> X) \"an instance\"
 use belt as second(start = first.moving.active, limit = 1 s)
 macro pair {
  entry step first
  step between { Z }
  exit step last { priority 1 }
  first -> between when a
  between -> last when rise(b)
 }
";

/// Comments of steps and transitions.
const LABELS: &[&str] = &[
    " \"a comment\"",
    " \"says \\\"go\\\" & <waits>, then \\\\\"",
    " \"a comment that is much longer than anything else that is near to it in the drawing\"",
    " \"\u{441}\u{442}\u{43e}\u{43f} \u{5d0}\u{5d1} \u{1f680}\"",
];

/// A library chart.
const LIBRARY: &str = "library chart belt(input start, output run, const limit = 3 s) {
 initial step idle
 step moving { run }
 idle -> moving when start
 moving -> idle when moving.t >= limit or not start
}
";

/// Another chart, which forcing orders name.
const OTHER: &str = "
chart other {
 input stop
 initial step one
 step two
 one -> two when stop
 two -> one when not stop
}
";

impl Chart {
    fn below(&mut self, n: usize) -> usize {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 20) as usize % n.max(1)
    }

    fn known_step(&mut self) -> String {
        let at = self.below(self.names.len());
        self.names[at].clone()
    }

    fn name(&mut self) -> String {
        let n = self.names.len();
        let name = match if self.is_rich { self.below(12) } else { 11 } {
            0 => format!("`step {n} of the line`"),
            1 => format!("a_name_that_is_much_longer_than_its_box_{n}"),
            2 => format!("Überlauf_{n}"),
            3 => format!("`<b>\u{65e5}\u{672c} & \u{1f680} {n}</b>`"),
            4 => format!("`a.b / page {n}`"),
            6 => format!("`line.s{n}`"),
            5 => format!("Xs{n}"),
            _ => format!("s{n}"),
        };
        self.names.push(name.clone());
        name
    }

    fn step(&mut self) -> String {
        let name = self.name();
        let initial = if std::mem::take(&mut self.is_first) { "initial " } else { "" };
        if self.is_rich && initial.is_empty() {
            let n = self.names.len();
            match self.below(8) {
                0 => {
                    let _ = writeln!(self.steps, " macro step {name} = pair");
                    return name;
                }
                1 => {
                    let _ = writeln!(
                        self.steps,
                        " enclosing step {name} {{\n  step in{n} * {{ X }}\n  step out{n}\n  in{n} -> out{n} when c\n  out{n} -> in{n}\n }}"
                    );
                    return name;
                }
                _ => {}
            }
        }
        let n_forms = if self.is_rich { 23 } else { 9 };
        let mut body = String::new();
        for _ in 0..self.below(4) {
            let item = match self.below(n_forms) {
                0 => "Y if a and not b",
                1 => "Y after 3 s",
                2 => "Z for 500 ms if not (a or c)",
                3 => "entry { n := n + 1 }",
                4 => "exit { n := 0; n := n + 2 }",
                5 => "set X",
                6 => "X SD 2 s",
                7 => "priority 3",
                9 => "go()",
                10 => "on E, F when not b { n := 2 }",
                11 => "when a { n := 3 }",
                12 => "force other { one, two }",
                13 => "force other init",
                14 => "X SL 5 s",
                15 => "X pulse",
                16 => "Y if 3 s/a/2 s",
                17 => "task `the work` cost 80 { n := 2; n := n + 1 }",
                18 => "budget 200",
                20 => "`valve.left`",
                21 => "`first.left` if `door.is.open`",
                22 => "exit { `valve.left` := not `first.left` }",
                19 => "code c \"if (x < 3 && y) PORTB |= 1;\"",
                _ => "Z",
            };
            let _ = write!(body, "{item}; ");
        }
        let labels = if self.is_rich { LABELS } else { &LABELS[..1] };
        let label = if self.below(4) == 0 { labels[self.below(labels.len())] } else { "" };
        let _ = writeln!(self.steps, " {initial}step {name}{label} {{ {body} }}");
        name
    }

    fn condition(&mut self, depth: usize) -> String {
        let n = if depth == 0 { 5 } else { 9 };
        match self.below(n) {
            0 => "a".to_owned(),
            1 => "rise(b)".to_owned(),
            2 => "n >= 3".to_owned(),
            3 => format!("{}.active", self.known_step()),
            4 => "2 s/c".to_owned(),
            5 => format!("not ({})", self.condition(depth - 1)),
            6 => format!("fall({})", self.condition(0)),
            7 => format!("({}) and ({})", self.condition(depth - 1), self.condition(depth - 1)),
            _ => format!("({}) or ({})", self.condition(depth - 1), self.condition(depth - 1)),
        }
    }

    fn transition(&mut self, from: &[String], to: &[String]) {
        let name = if self.below(3) == 0 {
            format!("t{}: ", self.transitions.len())
        } else {
            String::new()
        };
        let to = if to.is_empty() { "sink".to_owned() } else { to.join(" & ") };
        let _ = write!(self.transitions, " {name}{} -> {to}", from.join(" & "));
        if self.is_rich && self.below(6) == 0 {
            self.transitions.push_str(" on E, F");
        }
        if self.is_rich && !from.is_empty() && self.below(8) == 0 {
            self.transitions.push_str(" when otherwise");
        } else if self.below(6) > 0 {
            let condition = self.condition(2);
            let _ = write!(self.transitions, " when {condition}");
        }
        if !from.is_empty() && self.below(5) == 0 {
            let is_named = self.is_rich && self.below(2) == 0;
            self.transitions.push_str(if is_named { " after LIMIT" } else { " after 1500 ms" });
        }
        if self.below(6) == 0 {
            self.transitions.push_str(" priority 2");
        }
        if self.is_rich && self.below(9) == 0 {
            self.transitions.push_str(" restart deadline 20 ms");
        }
        if self.below(6) == 0 {
            self.transitions.push_str(" do { n := 1 }");
        }
        if self.is_rich && self.below(6) == 0 {
            let label = LABELS[self.below(LABELS.len())];
            self.transitions.push_str(label);
        }
        self.transitions.push('\n');
    }

    /// Adds something below a step and returns its last step.
    fn block(&mut self, from: &str, depth: usize) -> String {
        let from = from.to_owned();
        match if depth == 0 { 0 } else { self.below(5) } {
            0 | 1 => {
                let next = self.step();
                self.transition(&[from], from_ref(&next));
                if depth > 1 { self.block(&next, depth - 1) } else { next }
            }
            2 => {
                let n = 2 + self.below(2);
                let end = self.step();
                for _ in 0..n {
                    if self.below(4) == 0 {
                        self.transition(from_ref(&from), from_ref(&end));
                        continue;
                    }
                    let first = self.step();
                    self.transition(from_ref(&from), from_ref(&first));
                    let last = self.block(&first, depth - 1);
                    self.transition(&[last], from_ref(&end));
                }
                end
            }
            3 => {
                let n = 2 + self.below(2);
                let firsts: Vec<String> = (0..n).map(|_| self.step()).collect();
                self.transition(&[from], &firsts);
                let lasts: Vec<String> =
                    firsts.iter().map(|it| self.block(it, depth - 1)).collect();
                let end = self.step();
                self.transition(&lasts, from_ref(&end));
                end
            }
            _ => {
                let first = self.step();
                self.transition(&[from], from_ref(&first));
                let last = self.block(&first, depth - 1);
                let end = self.step();
                self.transition(from_ref(&last), &[first]);
                self.transition(&[last], from_ref(&end));
                end
            }
        }
    }
}
