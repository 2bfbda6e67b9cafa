/* The statechart engine of grafsynth: the same text for all charts. Do not edit. */
#include "grafsynth_btrans.h"

static void gb_put(uint8_t *bits, uint16_t at, bool value)
{
    const uint8_t mask = (uint8_t)(1U << (at & 7U));
    const uint16_t byte = at >> 3;
    if (value) {
        bits[byte] = (uint8_t)(bits[byte] | mask);
    } else {
        bits[byte] = (uint8_t)(bits[byte] & (uint8_t)~mask);
    }
}

/* --- bit positions ------------------------------------------------------------------------------------------------------------------------ */

static uint16_t gb_remembered(const gb_run_t *run, uint16_t bit)
{
    return (uint16_t)(run->chart->states + bit);
}

static uint16_t gb_edge(const gb_run_t *run, uint16_t edge)
{
    return (uint16_t)(run->chart->states + run->chart->remembered + edge);
}

static uint16_t gb_entered(const gb_run_t *run, uint16_t state)
{
    return (uint16_t)(run->chart->states + state);
}

static uint16_t gb_by_default(const gb_run_t *run, uint16_t history)
{
    return (uint16_t)((2U * run->chart->states) + history);
}

static uint16_t gb_now(const gb_run_t *run, uint16_t edge)
{
    return (uint16_t)((2U * run->chart->states) + run->chart->histories + edge);
}

static int32_t gb_rule(gb_run_t *run, uint16_t number)
{
    int32_t value = 0;
    if (number != 0U) {
        run->number = number;
        value = run->chart->rule(run);
    }
    return value;
}

bool gb_rise(const gb_run_t *run, uint16_t edge)
{
    return run->fresh && gb_bit(run->marks, gb_now(run, edge)) && !gb_bit(run->active, gb_edge(run, edge));
}

bool gb_fall(const gb_run_t *run, uint16_t edge)
{
    return run->fresh && !gb_bit(run->marks, gb_now(run, edge)) && gb_bit(run->active, gb_edge(run, edge));
}

/* --- states of a transition --------------------------------------------------------------------------------------------------------------- */

static bool gb_is_in(const gb_run_t *run, uint16_t state, uint16_t outer)
{
    return (outer == GB_NONE) || ((state > outer) && (state <= run->chart->bstate[outer].last));
}

/* The nearest common ancestor of origin and destination that has one active child: it contains all states exited and entered. GB_NONE: the chart. */
static uint16_t gb_domain(const gb_run_t *run, const gb_trans_t *transition)
{
    uint16_t up = transition->from;
    if (transition->kind == GB_EXTERNAL) {
        bool found = false;
        while (!found) {
            up = run->chart->bstate[up].ancestor;
            found = (up == GB_NONE)
                    || (((run->chart->bstate[up].status & GB_CONCURRENT) == 0U) && gb_is_in(run, transition->to, up));
        }
    }
    return up;
}

static void gb_row(const gb_run_t *run, uint16_t at, gb_trans_t *transition)
{
    transition->from = run->chart->btrans[at].from;
    transition->to = run->chart->btrans[at].to;
    transition->kind = run->chart->btrans[at].kind;
    transition->history = run->chart->btrans[at].history;
    transition->guard = 0U;
    transition->action = 0U;
}

/* The first and the last state in the domain of a transition; the first is greater than the last if the transition only runs its action. */
static void gb_leaves(const gb_run_t *run, uint16_t at, uint16_t *first, uint16_t *last)
{
    gb_trans_t transition;
    gb_row(run, at, &transition);
    if (transition.kind == GB_STAYS) {
        *first = 1U;
        *last = 0U;
    } else {
        const uint16_t domain = gb_domain(run, &transition);
        if (domain == GB_NONE) {
            /* All states. */
            *first = 0U;
            *last = (uint16_t)(run->chart->states - 1U);
        } else {
            *first = (uint16_t)(domain + 1U);
            *last = run->chart->bstate[domain].last;
        }
    }
}

/* --- a micro-step ------------------------------------------------------------------------------------------------------------------------- */

static void gb_set_active(gb_run_t *run, uint16_t state, bool active)
{
    const uint16_t timer = run->chart->bstate[state].timer;
    gb_put(run->active, state, active);
    if (timer != GB_NONE) {
        run->time[timer] = 0;
    }
}

/* Marks a state and its ancestors that are entered with it, up to the first that stays active. */
static void gb_path(gb_run_t *run, uint16_t state, uint16_t domain)
{
    for (uint16_t up = state; up != domain; up = run->chart->bstate[up].ancestor) {
        gb_put(run->marks, gb_entered(run, up), true);
    }
}

/* The bit of a descendant in a history. */
static uint16_t gb_offset(uint16_t bit, uint16_t owner, uint16_t state)
{
    const uint16_t below = (uint16_t)(state - owner);
    return (uint16_t)((uint16_t)(bit + below) - 1U);
}

/* Marks the recorded states of a history or, if there are none, its default. */
static void gb_recall(gb_run_t *run, uint16_t number, uint16_t domain)
{
    const uint16_t owner = run->chart->history[number].owner;
    const uint16_t last = run->chart->bstate[owner].last;
    const uint16_t bit = run->chart->history[number].bit;
    bool found = false;
    for (uint16_t s = (uint16_t)(owner + 1U); s <= last; ++s) {
        if (gb_bit(run->active, gb_remembered(run, gb_offset(bit, owner, s)))) {
            found = true;
            gb_path(run, s, domain);
        }
    }
    if (!found) {
        gb_put(run->marks, gb_by_default(run, number), true);
        gb_path(run, run->chart->history[number].to, domain);
    }
}

/* Marks the children of entered states: all of a concurrent state; of a hierarchical one the default, unless another child is entered. */
static void gb_descend(gb_run_t *run)
{
    for (uint16_t s = 0U; s < run->chart->states; ++s) {
        const uint16_t first = run->chart->bstate[s].descendant;
        if (gb_bit(run->marks, gb_entered(run, s)) && (first != GB_NONE)) {
            const bool all = (run->chart->bstate[s].status & GB_CONCURRENT) != 0U;
            bool any = false;
            uint16_t child = first;
            do {
                if (all) {
                    gb_put(run->marks, gb_entered(run, child), true);
                }
                any = any || gb_bit(run->marks, gb_entered(run, child));
                child = run->chart->bstate[child].sibling;
            } while (child != first);
            if (!any) {
                gb_put(run->marks, gb_entered(run, first), true);
            }
        }
    }
}

static void gb_remember(gb_run_t *run)
{
    for (uint16_t h = 0U; h < run->chart->histories; ++h) {
        const uint16_t owner = run->chart->history[h].owner;
        const bool deep = run->chart->history[h].deep != 0U;
        if (gb_bit(run->marks, owner)) {
            const uint16_t last = run->chart->bstate[owner].last;
            const uint16_t bit = run->chart->history[h].bit;
            for (uint16_t s = (uint16_t)(owner + 1U); s <= last; ++s) {
                const uint16_t below = run->chart->bstate[s].descendant;
                const uint16_t above = run->chart->bstate[s].ancestor;
                const bool counts = deep ? (below == GB_NONE) : (above == owner);
                const bool active = gb_bit(run->active, s);
                gb_put(run->active, gb_remembered(run, gb_offset(bit, owner, s)), counts && active);
            }
        }
    }
}

static void gb_clear(gb_run_t *run)
{
    const uint16_t bits = gb_now(run, 0U);
    for (uint16_t i = 0U; i < bits; ++i) {
        gb_put(run->marks, i, false);
    }
    run->n_chosen = 0U;
}

/* Activates the marked states, outermost first. */
static void gb_activate(gb_run_t *run)
{
    for (uint16_t s = 0U; s < run->chart->states; ++s) {
        if (gb_bit(run->marks, gb_entered(run, s))) {
            gb_set_active(run, s, true);
            (void)gb_rule(run, run->chart->bstate[s].entry);
            for (uint16_t h = 0U; h < run->chart->histories; ++h) {
                if ((run->chart->history[h].owner == s) && gb_bit(run->marks, gb_by_default(run, h))) {
                    (void)gb_rule(run, run->chart->history[h].rule);
                }
            }
        }
    }
}

/* Fires the chosen transitions: exits innermost first, actions, entries. */
static void gb_fire(gb_run_t *run)
{
    for (uint16_t i = 0U; i < run->n_chosen; ++i) {
        uint16_t first;
        uint16_t last;
        gb_leaves(run, run->chosen[i], &first, &last);
        for (uint16_t s = first; s <= last; ++s) {
            gb_put(run->marks, s, gb_bit(run->active, s) || gb_bit(run->marks, s));
        }
    }
    gb_remember(run);
    for (uint16_t i = 0U; i < run->n_chosen; ++i) {
        gb_trans_t transition;
        gb_row(run, run->chosen[i], &transition);
        if (transition.kind != GB_STAYS) {
            const uint16_t domain = gb_domain(run, &transition);
            gb_path(run, transition.to, domain);
            if (transition.history != GB_NONE) {
                gb_recall(run, transition.history, domain);
            }
        }
    }
    gb_descend(run);
    for (uint16_t s = run->chart->states; s > 0U; --s) {
        const uint16_t state = (uint16_t)(s - 1U);
        if (gb_bit(run->marks, state)) {
            (void)gb_rule(run, run->chart->bstate[state].exit);
            gb_set_active(run, state, false);
        }
    }
    for (uint16_t i = 0U; i < run->n_chosen; ++i) {
        (void)gb_rule(run, run->chart->btrans[run->chosen[i]].action);
    }
    gb_activate(run);
}

/* Chooses a transition if it precedes all chosen ones that exit some of the same states; removes these. */
static void gb_take(gb_run_t *run, uint16_t at)
{
    const uint16_t from = run->chart->btrans[at].from;
    bool wins = true;
    uint16_t first;
    uint16_t last;
    gb_leaves(run, at, &first, &last);
    for (uint8_t pass = 0U; pass < 2U; ++pass) {
        uint16_t kept = 0U;
        for (uint16_t i = 0U; wins && (i < run->n_chosen); ++i) {
            const uint16_t other = run->chosen[i];
            const uint16_t other_from = run->chart->btrans[other].from;
            uint16_t other_first;
            uint16_t other_last;
            gb_leaves(run, other, &other_first, &other_last);
            const bool meets = (first <= last) && (other_first <= other_last) && (first <= other_last) && (other_first <= last);
            if (pass == 0U) {
                const bool before =
                    run->chart->inner ? gb_is_in(run, from, other_from) : gb_is_in(run, other_from, from);
                wins = (at != other) && (!meets || before);
            } else if (!meets) {
                run->chosen[kept] = other;
                ++kept;
            } else {
                /* removed */
            }
        }
        if (wins && (pass == 1U)) {
            run->n_chosen = kept;
        }
    }
    if (wins && (run->n_chosen < run->chart->most)) {
        run->chosen[run->n_chosen] = at;
        ++run->n_chosen;
    }
}

/* The first fireable transition from this state in the event's rows. */
static uint16_t gb_first(gb_run_t *run, uint16_t event, uint16_t state)
{
    const uint16_t first = run->chart->index[event].first;
    const uint16_t many = run->chart->index[event].many;
    uint16_t found = GB_NONE;
    for (uint16_t i = 0U; (found == GB_NONE) && (i < many); ++i) {
        const uint16_t at = (uint16_t)(first + i);
        if (run->chart->btrans[at].from == state) {
            const uint16_t guard = run->chart->btrans[at].guard;
            if ((guard == 0U) || (gb_rule(run, guard) != 0)) {
                found = at;
            }
        }
    }
    return found;
}

/* Chooses the transitions that fire on an event (row 0: without an event). */
static void gb_choose(gb_run_t *run, uint16_t event)
{
    gb_clear(run);
    if (run->chart->index[event].many > 0U) {
        for (uint16_t s = 0U; s < run->chart->states; ++s) {
            if ((run->chart->bstate[s].descendant == GB_NONE) && gb_bit(run->active, s)) {
                uint16_t offered = GB_NONE;
                uint16_t up = s;
                while ((up != GB_NONE) && (!run->chart->inner || (offered == GB_NONE))) {
                    const uint16_t found = gb_first(run, event, up);
                    offered = (found != GB_NONE) ? found : offered;
                    up = run->chart->bstate[up].ancestor;
                }
                if (offered != GB_NONE) {
                    gb_take(run, offered);
                }
            }
        }
    }
}

/* Micro-steps until nothing fires and no event is left. */
static bool gb_evolve(gb_run_t *run, bool reset)
{
    const uint16_t events = run->chart->events;
    uint16_t next = reset ? events : 1U;
    uint16_t n = 0U;
    bool fault = false;
    bool again = true;
    while (again) {
        gb_choose(run, 0U);
        if (run->n_chosen == 0U) {
            while ((next < events) && (run->in[run->chart->index[next].input] == 0)) {
                ++next;
            }
            again = next < events;
            if (again) {
                n = 0U;
                gb_choose(run, next);
                ++next;
            }
        }
        if (run->n_chosen > 0U) {
            if (n == run->chart->limit) {
                fault = true;
                again = false;
            } else {
                gb_fire(run);
                run->fresh = false;
                ++n;
            }
        }
    }
    return fault;
}

/* --- reactions ---------------------------------------------------------------------------------------------------------------------------- */

static void gb_compare(gb_run_t *run)
{
    for (uint16_t e = 0U; e < run->chart->edges; ++e) {
        gb_put(run->marks, gb_now(run, e), gb_rule(run, (uint16_t)(e + 1U)) != 0);
    }
    run->fresh = true;
}

static void gb_renew(gb_run_t *run)
{
    for (uint16_t e = 0U; e < run->chart->edges; ++e) {
        gb_put(run->active, gb_edge(run, e), gb_bit(run->marks, gb_now(run, e)));
    }
    run->fresh = false;
}

bool gb_init(gb_run_t *run)
{
    const uint16_t bits = gb_edge(run, run->chart->edges);
    bool fault;
    for (uint16_t i = 0U; i < bits; ++i) {
        gb_put(run->active, i, false);
    }
    for (uint16_t i = 0U; i < run->chart->vars; ++i) {
        run->values[i] = run->chart->values[i];
    }
    for (uint16_t i = 0U; i < run->chart->timers; ++i) {
        run->time[i] = 0;
    }
    run->fresh = false;
    gb_clear(run);
    for (uint16_t i = 0U; i < run->chart->initials; ++i) {
        gb_put(run->marks, gb_entered(run, run->chart->initial[i]), true);
    }
    gb_descend(run);
    gb_activate(run);
    gb_compare(run);
    fault = gb_evolve(run, true);
    gb_renew(run);
    return fault;
}

bool gb_step(gb_run_t *run, uint32_t dt)
{
    bool fault;
    for (uint16_t s = 0U; s < run->chart->states; ++s) {
        const uint16_t timer = run->chart->bstate[s].timer;
        if ((timer != GB_NONE) && gb_bit(run->active, s)) {
            const int32_t rest = run->chart->caps[timer] - run->time[timer];
            if (dt < (uint32_t)rest) {
                run->time[timer] += (int32_t)dt;
            } else {
                run->time[timer] = run->chart->caps[timer];
            }
        }
    }
    gb_compare(run);
    fault = gb_evolve(run, false);
    gb_renew(run);
    return fault;
}

int32_t gb_output(gb_run_t *run, uint16_t output)
{
    return gb_rule(run, (uint16_t)(run->chart->edges + output + 1U));
}
