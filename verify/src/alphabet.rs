//! The input rows that an exploration tries.

use grafsynth_ir::expr::{Expr, ExprKind, Type};
use grafsynth_ir::net::{InputId, InputKind, Leaf, Net, PropertyLeaf, PropertyRole};
use grafsynth_sim::{InputRow, breaks_assumption};

use crate::exclusive::net_expr;
use crate::relevance::Inputs;
use crate::verdict::OpenReason;

/// The relevant values of each input, and the chart's assumptions about them.
#[derive(Debug, Clone)]
pub(crate) struct Alphabet<'n> {
    net: &'n Net,
    values: Vec<Vec<i64>>,
    /// For each assumption, the inputs that it reads: the values of these inputs are chosen together.
    assumed: Vec<Inputs>,
    /// A row that satisfies all assumptions; inputs that are not relevant keep the values of this row.
    base: InputRow,
    events_exclusive: bool,
}

/// Why the inputs of a net cannot be enumerated.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum NoAlphabet {
    /// No row satisfies the assumptions.
    Contradiction,
    /// An input has too many values, or there are too many rows.
    TooMany(OpenReason),
}

impl<'n> Alphabet<'n> {
    /// The alphabet of a net. With `all_values`, it contains every value of every integer input. Otherwise it contains one value for each interval between the
    /// constants that an input is compared with, if the input is not used in any other way.
    pub(crate) fn of(net: &'n Net, all_values: bool, limit: u64) -> Result<Self, NoAlphabet> {
        let values = values(net, all_values, limit)?;
        let mut assumed = Vec::new();
        let mut constrained = Inputs::none(net);
        for property in
            net.properties.iter().filter(|property| property.role == PropertyRole::Assume)
        {
            let mut set = Inputs::none(net);
            for leaf in property.never.leaves() {
                if let PropertyLeaf::Net(Leaf::Input(input)) = leaf {
                    set.insert(*input);
                }
            }
            constrained.add(&set);
            assumed.push(set);
        }
        let base = InputRow::zero(net);
        let mut alphabet = Alphabet {
            net,
            values,
            assumed,
            base,
            events_exclusive: net.settings.events_exclusive,
        };
        if alphabet.excludes(&alphabet.base) {
            let rows = alphabet
                .rows(&constrained, limit.saturating_mul(16))
                .ok_or(NoAlphabet::TooMany(OpenReason::Assumptions))?;
            match rows.first() {
                Some(row) => alphabet.base = row.clone(),
                None => return Err(NoAlphabet::Contradiction),
            }
        }
        Ok(alphabet)
    }

    /// True for a row that no legal stimulus contains.
    pub(crate) fn excludes(&self, row: &InputRow) -> bool {
        let two_events = self.events_exclusive
            && self
                .net
                .inputs
                .iter()
                .filter(|(id, input)| input.kind.is_event() && row.value(*id) != 0)
                .count()
                > 1;
        two_events || breaks_assumption(self.net, row)
    }

    /// All rows over the relevant inputs, with the others at their base value; `None` if there are more than `limit` candidates.
    pub(crate) fn rows(&self, matter: &Inputs, limit: u64) -> Option<Vec<InputRow>> {
        let mut matter = matter.clone();
        loop {
            // The inputs of an assumption are chosen together.
            let before = matter.clone();
            for set in self.assumed.iter().filter(|set| set.meets(&before)) {
                matter.add(set);
            }
            if matter == before {
                break;
            }
        }
        let chosen: Vec<InputId> =
            self.net.inputs.ids().filter(|input| matter.contains(*input)).collect();
        let mut count: u64 = 1;
        for input in &chosen {
            count = count
                .checked_mul(self.values[input.index()].len() as u64)
                .filter(|count| *count <= limit)?;
        }
        let mut rows = Vec::with_capacity(count as usize);
        let mut row = self.base.clone();
        for input in &chosen {
            row.values[input.index()] = self.values[input.index()][0];
        }
        let mut digits = vec![0; chosen.len()];
        loop {
            if !self.excludes(&row) {
                rows.push(row.clone());
            }
            let Some(at) = (0..chosen.len())
                .find(|at| digits[*at] + 1 < self.values[chosen[*at].index()].len())
            else {
                break;
            };
            for lower in 0..at {
                digits[lower] = 0;
                row.values[chosen[lower].index()] = self.values[chosen[lower].index()][0];
            }
            digits[at] += 1;
            row.values[chosen[at].index()] = self.values[chosen[at].index()][digits[at]];
        }
        Some(rows)
    }
}

/// The values of each input that are tried.
pub(crate) fn values(net: &Net, all_values: bool, limit: u64) -> Result<Vec<Vec<i64>>, NoAlphabet> {
    let mut values = Vec::new();
    for (id, input) in net.inputs.iter() {
        let list = match (input.kind, input.ty) {
            (InputKind::InternalEvent, _) => vec![0],
            (_, Type::Bool) => vec![0, 1],
            (_, Type::Int { lo, hi }) => {
                let classes = if all_values { None } else { cuts(net, id, lo, hi) };
                match classes {
                    Some(classes) => classes,
                    None if hi.abs_diff(lo) < limit.min(4096) => (lo..=hi).collect(),
                    None => {
                        let input = input.name.to_string();
                        let values = hi.abs_diff(lo).saturating_add(1);
                        return Err(NoAlphabet::TooMany(OpenReason::InputValues { input, values }));
                    }
                }
            }
        };
        values.push(list);
    }
    Ok(values)
}

/// One value for each interval between the constants that an input is compared with; `None` if the input is used in any other way, or in a property that reads
/// outputs.
pub(crate) fn cuts(net: &Net, input: InputId, lo: i64, hi: i64) -> Option<Vec<i64>> {
    let mut cuts: Vec<i64> = vec![lo];
    let mut only_compared = true;
    for expr in net.expressions() {
        collect(expr, input, &mut cuts, &mut only_compared)
    }
    for property in &net.properties {
        match net_expr(&property.never) {
            Some(expr) => collect(&expr, input, &mut cuts, &mut only_compared),
            None => {
                let input = PropertyLeaf::Net(Leaf::Input(input));
                only_compared &= property.never.leaves().all(|leaf| *leaf != input);
            }
        }
    }
    cuts.retain(|cut| (lo..=hi).contains(cut));
    cuts.sort_unstable();
    cuts.dedup();
    only_compared.then_some(cuts)
}

fn collect(expr: &Expr<Leaf>, input: InputId, cuts: &mut Vec<i64>, only_compared: &mut bool) {
    if let ExprKind::Compare(_, a, b) = &expr.kind {
        let pair = match (&a.kind, &b.kind) {
            (ExprKind::Leaf(Leaf::Input(own)), ExprKind::Int(value)) if *own == input => {
                Some(*value)
            }
            (ExprKind::Int(value), ExprKind::Leaf(Leaf::Input(own))) if *own == input => {
                Some(*value)
            }
            _ => None,
        };
        if let Some(value) = pair {
            // `< v`, `= v` and `> v` are separate intervals; each begins where the previous one ends.
            cuts.push(value);
            cuts.push(value.saturating_add(1));
            return;
        }
    }
    if matches!(expr.kind, ExprKind::Leaf(Leaf::Input(own)) if own == input) {
        *only_compared = false;
    }
    expr.children().for_each(|operand| collect(operand, input, cuts, only_compared));
}
