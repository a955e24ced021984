// SPDX-License-Identifier: Apache-2.0
#include "interp/wire_offset.h"

#include "base/units.h"
#include "interp/plane.h"

#define HELD_TEXT 96    /* characters of a block that are kept; an event shows fewer */
#define HELD 2          /* a move, and a block without motion in the plane */
#define JOINED 2        /* pulses: ends of offset curves so close in each axis are joined midway */
#define LEAST 4         /* least radius of an arc, pulses: its ends are rounded to whole pulses */
#define ALIKE 16        /* at a cusp, arcs whose radii differ by no more pulses are the same arc */

typedef struct {
    plan p;
    char text[HELD_TEXT];
    uint32_t length, line, number;
} held_block;

/* The beginning or end of a move at a corner. Vectors count from that corner, in 1/64 pulse. */
typedef struct {
    bool arc, ccw;
    vector direction;   /* of the motion, of any length */
    vector normal;      /* unit vector to the side of the offset, 2**-30 */
    vector away;        /* the same direction, as long as the offset */
    vector centre;      /* of an arc */
    int32_t radius;     /* of the offset arc */
    int32_t bow;        /* radius of the programmed arc, negative if it bends right; 0 for a line */
} edge;

static held_block held[HELD];
static unsigned held_count;
static unsigned given, to_give;         /* held blocks: already handed out, and to be handed out */
static wire_offset_block told;          /* the block taken last */
static plan *fresh;                     /* its plan */
static enum { FRESH_NOTHING, FRESH_PASSES, FRESH_STAYS } fate; /* of the block taken last */
static enum { STEP_NONE, STEP_BEGINNING, STEP_ENDING, STEP_CORNER, STEP_MOVE, STEP_TRAVEL,
              STEP_AFTER } step;

/* State while the wire offset is on. The held move ends at a corner where the fresh one begins. */
static bool on, leads_in, leads_out;    /* the held move leads in; the fresh move leads out */
static int8_t side;
static int32_t offset;                  /* 1/64 pulse */
static move_plane plane;
static vector shift;                    /* from the held move's programmed start to its new one */
static vector sector;                   /* from the centre of the held move's arc to that start */
static bool trimmed;                    /* the held move's start was moved inside a corner */
static edge ending, beginning;          /* end of the held move, beginning of the fresh move */
static vector meeting;                  /* where the offset curves meet, from the corner */
static bool meets;                      /* inside a corner: the offset curves meet */
static bool rounds;                     /* outside a corner: the path goes round in an arc */
static bool cusp;                       /* the fresh move goes back beside the held one */
static vector next_shift;               /* `shift` of the fresh move; both shifts in pulses */
static int32_t start[HAL_AXES];         /* of the move whose travel is being checked */

void wire_offset_reset(void) {
    held_count = given = to_give = 0;
    on = leads_in = false;
    fate = FRESH_NOTHING;
    step = STEP_NONE;
}

const modal *wire_offset_state(const modal *executed) {
    return held_count ? &held[held_count - 1].p.after : executed;
}

/* Give a fault the line and number of the held move, which came in an earlier block. */
static fault *of_held(fault *f) {
    f->line = held[0].line;
    f->block = held[0].number;
    return f;
}

/* Take a block without motion in the plane while a move is held. */
static bool between(const plan *p, fault *f) {
    if (p->stop == STOP_END)
        return fault_at(f, FAULT_CORNER, 0,
                        "the program ends under a wire offset; a motion with G40 must come before");
    if (held_count == HELD)
        return fault_at(f, FAULT_CORNER, 0,
                        "under a wire offset two blocks in a row have no motion in its plane");
    return true;
}

static bool begin(const plan *p, fault *f) {
    if (p->move.arc)
        return fault_at(f, FAULT_CORNER, p->arc_column,
                        "the wire offset must begin with a line, not with an arc");
    if (p->stop == STOP_END)
        return between(p, f);
    on = leads_in = true;
    side = p->after.side;
    offset = p->after.wires[p->after.wire] * MOVE_FINE;
    plane = p->after.plane;
    shift = (vector){0, 0};
    trimmed = false;
    return true;
}

static bool follow(const plan *p, fault *f) {
    if (p->after.plane != plane)
        return fault_at(f, FAULT_CORNER, 0,
                        "the plane changes before the wire offset has ended in a motion with G40");
    if (!plane_moves(&p->move))
        return between(p, f);
    if (p->corners)
        return fault_at(f, FAULT_CORNER, 0,
                        "the wire offset must end with one line in its plane, before G28 or G30");
    leads_out = !p->after.side;
    if (!leads_out && (p->after.side != side || p->after.wires[p->after.wire] * MOVE_FINE != offset))
        return fault_at(f, FAULT_CORNER, 0,
                        "a wire offset begins before the one before has ended in a motion with G40");
    if (leads_out && p->move.arc)
        return fault_at(f, FAULT_CORNER, p->arc_column,
                        "the wire offset must end with a line, not with an arc");
    if (leads_out && leads_in)
        return fault_at(f, FAULT_CORNER, 0, "the wire offset ends with no motion beside the path");
    if (p->stop == STOP_END && !leads_out)
        return between(p, f);
    step = leads_out ? STEP_ENDING : STEP_BEGINNING;
    return true;
}

bool wire_offset_take(plan *p, const char *text, uint32_t length, uint32_t line, uint32_t number,
                      fault *f) {
    fresh = p;
    told = (wire_offset_block){p, text, length, line, number};
    step = STEP_NONE;
    fate = FRESH_STAYS;
    if (on && !length)
        fate = FRESH_NOTHING; /* a block without words has no effect at a corner */
    else if (on)
        return follow(p, f);
    else if (p->after.side && plane_moves(&p->move))
        return begin(p, f);
    else
        fate = FRESH_PASSES;
    return true;
}

static vector rounded(vector a) {
    int32_t half = MOVE_FINE / 2;
    return (vector){(a.u + (a.u < 0 ? -half : half)) / MOVE_FINE,
                    (a.v + (a.v < 0 ? -half : half)) / MOVE_FINE};
}

static bool near(vector a, vector b, int32_t by) {
    vector d = vector_difference(a, b);
    return d.u <= by && -d.u <= by && d.v <= by && -d.v <= by;
}

/* Vector from the centre of an arc to its end. */
static vector end_radius(const path_move *m) {
    return vector_difference(vector_times(plane_delta(m), MOVE_FINE), plane_centre(m));
}

/* Describe an end of a move. False with a fault if the offset leaves an arc too small a radius. */
static bool find_edge(edge *e, const path_move *m, bool at_end, fault *f) {
    *e = (edge){.arc = m->arc, .ccw = m->ccw};
    if (!m->arc) {
        e->direction = plane_delta(m);
    } else {
        vector radius = at_end ? end_radius(m) : vector_times(plane_centre(m), -1);
        int32_t length = (int32_t)vector_length(radius);
        e->centre = vector_times(radius, -1);
        e->direction = vector_times(vector_left(radius), m->ccw ? 1 : -1);
        e->radius = length + (m->ccw == (side > 0) ? -offset : offset);
        e->bow = m->ccw ? length : -length;
        if (e->radius < (offset ? LEAST : 1) * MOVE_FINE)
            return fault_at(f, FAULT_CORNER, 0,
                            "the wire offset of %p mm does not fit into the arc's radius of %p mm",
                            offset / MOVE_FINE, length / MOVE_FINE);
    }
    e->normal = vector_unit(vector_times(vector_left(e->direction), side));
    e->away = vector_along(e->normal, offset);
    return true;
}

static vector tangent(const edge *e) { return vector_times(vector_left(e->normal), -side); }

/* Find where two lines, or the tangents of arcs, meet. Returns how far back from the corner, which
   is the offset times the tangent of half the turn, 1/64 pulse; negative if they do not meet. */
static int64_t lines_meet(void) {
    int64_t one = (int64_t)1 << (2 * VECTOR_UNIT);
    int64_t dot = vector_dot(ending.normal, beginning.normal);
    int64_t cross = vector_cross(ending.normal, beginning.normal) * side;
    /* Two equal formulas; the choice avoids the loss of digits near 0 and near half a turn. */
    uint32_t above = (uint32_t)((dot < 0 ? one - dot : cross) >> VECTOR_UNIT);
    uint32_t below = (uint32_t)((dot < 0 ? cross : one + dot) >> VECTOR_UNIT);
    if (cross <= 0 || !below)
        return -1;
    uint64_t back = units_quotient((uint64_t)(uint32_t)offset * above, below);
    if (back > 1u << 30)
        return -1;
    meeting = vector_difference(ending.away, vector_along(tangent(&ending), (int32_t)back));
    return (int64_t)back;
}

/* Find where a line and an arc meet: the point that goes to the corner as the offset goes to 0. */
static bool line_meets(const edge *line, const edge *arc) {
    vector to = tangent(line), centre = vector_difference(arc->centre, line->away);
    int64_t radius = arc->radius, across = vector_part(centre, line->normal);
    int64_t square = radius * radius - across * across;
    if (square < 0)
        return false;
    int64_t half = units_root((uint64_t)square);
    bool behind = cusp ? line == &ending : vector_part(arc->centre, to) > 0;
    int64_t along = vector_part(centre, to) + (behind ? -half : half);
    meeting = vector_sum(line->away, vector_along(to, (int32_t)along));
    /* The point must lie before the end of the held move, or after the start of the fresh one. */
    return line == &ending ? along <= 0 : along >= 0;
}

/* Find where two arcs meet: the point on the corner's side of the line through the centres. At a
   cusp the corner lies on that line; take the side from which the moves come. Start from the
   smaller arc: rounding near a large circle would move the point far along it. */
static bool arcs_meet(void) {
    bool swap = beginning.radius < ending.radius;
    const edge *base = swap ? &beginning : &ending, *other = swap ? &ending : &beginning;
    vector line = vector_difference(other->centre, base->centre), scaled = line;
    int64_t a = base->radius, b = other->radius;
    int64_t square = vector_dot(line, line), length = units_root((uint64_t)square);
    if (square == 0 || length + 1 < b - a || length > a + b + 1)
        return false;
    unsigned bits = 0;
    for (; length < 1 << 29; length <<= 1)
        bits++;
    scaled = vector_times(line, 1 << bits);
    /* From the centre to the foot of the point. The root is exact only with all its bits. */
    int64_t twice = square - (b - a) * (a + b);
    uint64_t value = (uint64_t)(twice < 0 ? -twice : twice) << bits;
    int64_t foot = (int64_t)units_quotient(value / 2, vector_length(scaled));
    if (foot > a)
        return false;
    int64_t across = units_root((uint64_t)(a * a - foot * foot));
    vector to = vector_unit(line);
    if (cusp ? vector_cross(line, ending.direction) > 0 : vector_cross(line, base->centre) > 0)
        across = -across;
    meeting = vector_sum(base->centre, vector_along(to, (int32_t)(twice < 0 ? -foot : foot)));
    meeting = vector_sum(meeting, vector_along(vector_left(to), (int32_t)across));
    return true;
}

/* Is the meeting point on the remainder of the held move and on the fresh move, and within half a
   turn of the corner? On a circle, a point just beyond the end is not one at the start. */
static bool on_both(void) {
    vector to = vector_times(ending.centre, -1), from = vector_times(beginning.centre, -1);
    vector last = vector_difference(meeting, ending.centre);
    vector first = vector_difference(meeting, beginning.centre);
    int64_t before = vector_cross(last, to), after = vector_cross(from, first);
    if (ending.arc && ((ending.ccw ? before : -before) < 0 ||
                       !vector_within(sector, to, ending.ccw, last)))
        return false;
    return !beginning.arc || ((beginning.ccw ? after : -after) >= 0 &&
                              vector_within(from, end_radius(&fresh->move), beginning.ccw, first));
}

/* At a shallow corner, rounding of a radius moves the meeting point further than the corner itself
   does. Use the tangents instead, if they meet within half a pulse of both curves. */
static bool tangents_meet(void) {
    if (vector_dot(ending.direction, beginning.direction) <= 0)
        return false;
    int64_t back = lines_meet();
    return back >= 0 && (!ending.arc || back * back <= ending.radius * (int64_t)MOVE_FINE) &&
           (!beginning.arc || back * back <= beginning.radius * (int64_t)MOVE_FINE);
}

static int64_t size(int64_t value) { return value < 0 ? -value : value; }

/* Is the corner a cusp, where the fresh move goes back beside the held one? Returns the side to
   which they bend apart: left (1) or right (-1) of the held one. At a cusp this side, and not the
   directions, shows the inside. Moves are tangent if the area between them, up to where curvature
   makes them cross again, is at most a pulse wide: if the square of the sine is less than twice the
   sum of their curvatures. Two arcs of nearly equal radius are one way there and back. */
static int find_cusp(void) {
    int64_t a = ending.bow, b = beginning.bow, sum = size(a + b);
    int64_t sine = vector_cross(ending.normal, beginning.normal) / (1 << VECTOR_UNIT);
    cusp = false;
    if (vector_dot(ending.normal, beginning.normal) >= 0 || (!a && !b))
        return 0;
    if (sum <= ALIKE * MOVE_FINE) {
        cusp = size(sine) * size(a) <= (int64_t)ALIKE * MOVE_FINE << VECTOR_UNIT;
        return side;
    }
    sine /= 1 << 15;
    int64_t square = sine * sine;
    cusp = a && b ? (square * size(a) >> 30) * size(b) < 2 * MOVE_FINE * sum
                  : square * sum >> 30 < 2 * MOVE_FINE;
    return (a + b > 0) != (a && b && (a > 0) != (b > 0)) ? 1 : -1;
}

static bool find_corner(fault *f) {
    meets = rounds = false;
    if (leads_in || leads_out) {
        meeting = leads_in ? beginning.away : ending.away;
        return true;
    }
    int64_t turn = vector_cross(ending.direction, beginning.direction) * side;
    meeting = (vector){(ending.away.u + beginning.away.u) / 2, (ending.away.v + beginning.away.v) / 2};
    if (near(ending.away, beginning.away, JOINED * MOVE_FINE) &&
        vector_dot(ending.direction, beginning.direction) > 0)
        return true;
    if (!offset)
        return true;
    int bend = find_cusp();
    rounds = cusp ? bend == side : turn <= 0;
    meets = !rounds;
    if (rounds)
        return true;
    bool found = ending.arc ? beginning.arc ? arcs_meet() : line_meets(&beginning, &ending)
                            : beginning.arc ? line_meets(&ending, &beginning) : lines_meet() >= 0;
    return (found && on_both()) || tangents_meet() ||
           fault_at(f, FAULT_CORNER, 0,
                    "inside the corner with the move before, the offset paths of %p mm do not meet",
                    offset / MOVE_FINE);
}

/* Move the start of a move by `from` pulses and its end by `to` pulses. */
static void shift_move(path_move *m, vector from, vector to) {
    plane_axes axes = PLANE_AXES[m->plane];
    m->delta[axes.first] += to.u - from.u;
    m->delta[axes.second] += to.v - from.v;
    m->centre[0] -= m->arc ? from.u * MOVE_FINE : 0;
    m->centre[1] -= m->arc ? from.v * MOVE_FINE : 0;
}

/* Does a move end elsewhere than it starts? */
static bool leads_away(const path_move *m) {
    return m->delta[0] || m->delta[1] || m->delta[2];
}

static void find_start(const plan *p, vector by) {
    plane_axes axes = PLANE_AXES[plane];
    for (unsigned axis = 0; axis < HAL_AXES; axis++)
        start[axis] = p->after.position[axis] - p->move.delta[axis];
    start[axes.first] += by.u;
    start[axes.second] += by.v;
}

/* Vector from the centre of the held arc to its end after the corner is taken off. */
static vector last_radius(void) {
    return meets ? vector_difference(meeting, ending.centre) : vector_times(ending.centre, -1);
}

static bool is_circle(const path_move *m) {
    vector delta = plane_delta(m);
    return !delta.u && !delta.v;
}

/* Is the remainder of the held arc no longer than the rounding of its ends? */
static bool is_speck(const path_move *m) {
    vector last = last_radius();
    int64_t turn = vector_cross(sector, last);
    return (turn == 0 || (turn > 0) == m->ccw) && vector_dot(sector, last) > 0;
}

/* Does the remainder of the held arc end at its start or just before it, so that it is a circle? */
static bool goes_round(const path_move *m) {
    vector last = last_radius();
    int64_t turn = vector_cross(sector, last);
    if (vector_dot(sector, last) <= 0)
        return false;
    return is_circle(m) ? vector_dot(sector, plane_centre(m)) < 0 : turn && (turn > 0) != m->ccw;
}

/* Do its two corners take more than the whole held arc? What is left would be nearly a circle. */
static bool is_used_up(const path_move *m) {
    vector from = vector_times(plane_centre(m), -1), to = vector_times(ending.centre, -1);
    vector last = last_radius();
    return !vector_within(from, to, m->ccw, sector) || !vector_within(from, to, m->ccw, last) ||
           (trimmed && meets && vector_cross(from, sector) &&
            (!is_circle(m) || vector_cross(from, last)) && vector_within(from, sector, m->ccw, last));
}

/* Complete the held move: both of its ends are known now. */
static bool finish_move(fault *f) {
    plan *p = &held[0].p;
    path_move *m = &p->move;
    vector programmed = plane_delta(m), end = rounded(rounds ? ending.away : meeting);
    vector left = vector_sum(programmed, vector_difference(end, shift));
    bool no_more = near(left, (vector){0, 0}, JOINED);
    bool gone = m->arc ? is_used_up(m) : !leads_in && vector_dot(left, programmed) < 0;
    /* Full circles and nearly full ones become full: rounding could exchange their ends. */
    bool closed = m->arc && no_more && !gone && goes_round(m);
    if (closed)
        end = vector_difference(shift, programmed);
    next_shift = rounds ? rounded(beginning.away) : end;
    find_start(p, shift);
    shift_move(m, shift, end);
    if (m->arc && !closed && no_more && (gone || is_speck(m)))
        m->arc = false;
    else if (gone && !no_more)
        return fault_at(of_held(f), FAULT_CORNER, 0,
                        "the wire offset of %p mm leaves nothing of this move between its corners",
                        offset / MOVE_FINE);
    p->moves = m->arc || leads_away(m);
    if (!rounds)
        return true;
    fresh->corner = (path_move){.arc = offset >= LEAST * MOVE_FINE, .ccw = side < 0, .plane = plane};
    shift_move(&fresh->corner, end, next_shift);
    fresh->corners = leads_away(&fresh->corner);
    fresh->corner_speed = fresh->speed < p->speed ? fresh->speed : p->speed;
    fresh->corner_rapid = fresh->rapid && p->rapid;
    return true;
}

static bool within_travel(const path_move *m, const travel_range *t, fault *f) {
    unsigned axis = plane_beyond(start, m, t);
    return axis == HAL_AXES || fault_at(f, FAULT_TRAVEL, 0,
                                        "beside the path the travel of %c is too short", "XYZ"[axis]);
}

/* Check the travel of the fresh move's corner. If the move leads out, complete and check it too. */
static bool turn_to_fresh(const travel_range *t, fault *f) {
    find_start(fresh, next_shift);
    if (fresh->corners) {
        plane_axes axes = PLANE_AXES[plane];
        vector back = plane_delta(&fresh->corner);
        start[axes.first] -= back.u;
        start[axes.second] -= back.v;
        return within_travel(&fresh->corner, t, f);
    }
    if (leads_out) {
        shift_move(&fresh->move, next_shift, (vector){0, 0});
        fresh->moves = leads_away(&fresh->move);
        return within_travel(&fresh->move, t, f);
    }
    return true;
}

bool wire_offset_ready(void) { return step == STEP_NONE; }

plan_result wire_offset_step(const travel_range *t, fault *f) {
    bool right = true;
    switch (step) {
    case STEP_NONE: return PLAN_DONE;
    case STEP_BEGINNING:
        right = find_edge(&beginning, &fresh->move, false, f);
        step = leads_in ? STEP_CORNER : STEP_ENDING;
        break;
    case STEP_ENDING:
        right = find_edge(&ending, &held[0].p.move, true, of_held(f));
        f->line = right ? told.line : f->line;
        f->block = right ? told.number : f->block;
        step = STEP_CORNER;
        break;
    case STEP_CORNER:
        right = find_corner(f);
        step = STEP_MOVE;
        break;
    case STEP_MOVE:
        right = finish_move(f);
        step = STEP_TRAVEL;
        break;
    case STEP_TRAVEL:
        right = within_travel(&held[0].p.move, t, of_held(f));
        f->line = right ? told.line : f->line;
        f->block = right ? told.number : f->block;
        step = STEP_AFTER;
        break;
    case STEP_AFTER:
        right = turn_to_fresh(t, f);
        shift = next_shift;
        trimmed = meets;
        sector = meets ? vector_difference(meeting, beginning.centre)
                       : vector_times(beginning.centre, -1);
        leads_in = false;
        on = !leads_out;
        to_give = held_count;
        fate = leads_out ? FRESH_PASSES : FRESH_STAYS;
        step = STEP_NONE;
        break;
    }
    return !right ? PLAN_FAULT : step == STEP_NONE ? PLAN_DONE : PLAN_MORE;
}

static void keep(void) {
    held_block *h = &held[held_count++];
    h->p = *fresh;
    h->length = told.length < HELD_TEXT ? told.length : HELD_TEXT;
    for (uint32_t i = 0; i < h->length; i++)
        h->text[i] = told.text[i];
    h->line = told.line;
    h->number = told.number;
}

const wire_offset_block *wire_offset_next(void) {
    static wire_offset_block kept;
    if (given < to_give) {
        held_block *h = &held[given++];
        kept = (wire_offset_block){&h->p, h->text, h->length, h->line, h->number};
        return &kept;
    }
    if (to_give)
        held_count = given = to_give = 0;
    bool passes = fate == FRESH_PASSES;
    if (fate == FRESH_STAYS)
        keep();
    fate = FRESH_NOTHING;
    return passes ? &told : 0;
}
