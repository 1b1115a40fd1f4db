# ruff: noqa: PLR0917, PLR0915 (compiled functions take no keyword-only arguments, and the pass is one loop)
"""The log likelihood of each run: its slide simulated, and a Kalman filter on what may deviate from it, compiled.

All numbers are complex: the imaginary part of the result over a step of 1e-30 i in a parameter is the exact derivative
(Squire and Trapp 1998), to the last digit, through the crossing, the slide and the filter alike.

The moment of slip is summed over: each cell of time takes the probability that the pull passes the run's friction
within it for the first time, and a slide begins in its middle. Within a cell a slide is linearised: what may deviate is
(place along the way, speed, friction's wander, the run's friction).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from tests.spike.session import BEFORE_S, GRAVITY, TABLE_S

CELLS = 11
"""Of the moment of slip."""
SMOOTH = 3.0
"""A cell's friction has a variance of its growth squared over this: with 12 (that of a level density) the sum over
cells ripples by 39 % as a parameter moves through them and pins it; with 3 by 0.3 %."""
LEAST_GROWTH = 1e-6
"""Friction's least growth in a cell: no attitude is known better."""
AROUND_S, SLOW_GROWTH = 0.05, 0.2
"""The pull's mean growth is taken over twice the first, and is at least the second (1/s)."""

(MU, SU, SIG, NU, SW, LW, TAU, PIVOT, EX, EY, DROP, SAG, SF, SV, SN, RATE, DECADES, DRAG, AGE, AGE0, WEAR, WEARN,
 OX, OY, PX, PY, NX, NY, BX, BY) = range(30)  # fmt: skip
PATCH, PATCHL, SHAKE, FIDSIG, COUNT = 30, 38, 39, 40, 41
"""Places of the parameters; README.md has their meaning."""


@njit(cache=True, fastmath=False)
def _gap(x: complex) -> complex:
    """ln Γ(x + ½) − ln Γ(x) by Stirling's series."""
    total = 0.0j
    while x.real < 8.0:
        total += np.log(x / (x + 0.5))
        x += 1.0
    y = x + 0.5
    return (
        total + (y - 0.5) * np.log(y) - y + 1 / (12 * y) - 1 / (360 * y**3)
        - ((x - 0.5) * np.log(x) - x + 1 / (12 * x) - 1 / (360 * x**3))
    )  # fmt: skip


@njit(cache=True)
def _pull(th, rows, t, x, y, vx, vy, out):
    """Fills `out` with the pull along the plate, the normal force (per mass) and gravity's share."""
    at = (t - th[TAU]) / TABLE_S
    k = int(min(max(at.real, 0.0), len(rows) - 2.0))
    f = at - k
    a, b = rows[k], rows[k + 1]
    gx = a[0] + f * (b[0] - a[0]) + th[EX] * a[3] + th[EY] * a[6]
    gy = a[1] + f * (b[1] - a[1]) + th[EX] * a[4] + th[EY] * a[7]
    gn = a[2] + f * (b[2] - a[2]) + th[EX] * a[5] + th[EY] * a[8]
    wx, wy = a[9] + f * (b[9] - a[9]), a[10] + f * (b[10] - a[10])
    ax, ay = a[11] + f * (b[11] - a[11]), a[12] + f * (b[12] - a[12])
    h, w2, wr = th[PIVOT], wx * wx + wy * wy, wx * x + wy * y
    out[0] = GRAVITY * gx - ay * h + x * w2 - wx * wr - (a[13] + f * (b[13] - a[13]))
    out[1] = GRAVITY * gy + ax * h + y * w2 - wy * wr - (a[14] + f * (b[14] - a[14]))
    out[2] = -GRAVITY * gn + (a[15] + f * (b[15] - a[15])) + ax * y - ay * x + 2.0 * (wx * vy - wy * vx)
    out[3], out[4] = gx, gy


@njit(cache=True)
def _speed(th, v):
    """Sliding friction over static friction, but for ageing."""
    value = 1.0 - th[DROP]
    if th[SF] != 0.0:
        power = np.exp(th[SN] * np.log(v / np.exp(th[SV]) + 1e-12))
        tail = th[SN] - 1.0
        if tail.real < 1e-6:
            value *= 1.0 - th[SF] * (1.0 - np.exp(-power))
        else:
            value *= 1.0 - th[SF] * (1.0 - np.exp(-np.log(1.0 + tail * power) / tail))
    if th[RATE] != 0.0:
        value *= 1.0 + th[RATE] * np.log(1.0 + v * 10.0 * 10.0 ** th[DECADES])
    return value


@njit(cache=True)
def _place(th, x, y, mount):
    """ln of friction's dependence on the place: a Fourier series of the first order."""
    any_ = False
    for i in range(8):
        any_ = any_ or th[PATCH + i] != 0.0
    if not any_:
        return 0.0j
    c, s = math.cos(mount), math.sin(mount)
    length = np.exp(th[PATCHL])
    u, w = (c * x + s * y) / length, (c * y - s * x) / length
    su, sv, lu, lv = np.sin(u), np.sin(w), 1.0 - np.cos(u), 1.0 - np.cos(w)
    p = PATCH
    return (
        th[p] * su + th[p + 1] * sv + th[p + 2] * (lu + lv) + th[p + 3] * (lu - lv) + th[p + 4] * su * sv
        + th[p + 5] * su * lv + th[p + 6] * lu * sv + th[p + 7] * lu * lv
    )  # fmt: skip


@njit(cache=True)
def _needed(tx, ty, n, ch, kx, ky, cx, cy):
    """The coefficient that just holds a pull, for the friction set that is an ellipse (ch, k) about (cx, cy)."""
    a = (ch * (tx * tx + ty * ty) - (kx * (tx * tx - ty * ty) + 2 * ky * tx * ty)) / (n * n)
    if cx == 0.0 and cy == 0.0:
        return np.sqrt(a)
    b = (ch * (tx * cx + ty * cy) - (kx * (tx * cx - ty * cy) + ky * (tx * cy + ty * cx))) / n
    c = ch * (cx * cx + cy * cy) - (kx * (cx * cx - cy * cy) + 2 * ky * cx * cy)
    return a / (b + np.sqrt(b * b + a * (1.0 - c)))


@njit(cache=True)
def _level(th, rows, fact, t, x, y, ch, kx, ky, cx, cy, out):
    """ln of the run's friction over the mean if it slips at t."""
    _pull(th, rows, t, x, y, 0.0j, 0.0j, out)
    needed = _needed(out[0], out[1], out[2], ch, kx, ky, cx, cy)
    rest = fact[8] + (t - BEFORE_S) - th[TAU]
    age = 1.0 + th[AGE] * (np.log(rest + 0.1) / math.log(10.0) - th[AGE0])
    worn = 1.0 - th[WEAR] * (1.0 - np.exp(-fact[9] / np.exp(th[WEARN])))
    return np.log(needed) - th[MU] - np.log(age) - np.log(worn) - _place(th, x, y, fact[7]), needed, age


@njit(cache=True)
def _student(e, s, nu):
    """ln of Student's density of scale² s, and the weight of the observation."""
    r = e * e / s
    return _gap(0.5 * nu) - 0.5 * np.log(math.pi * nu * s) - 0.5 * (nu + 1) * np.log(1 + r / nu), (nu + 1) / (nu + r)


@njit(cache=True)
def _brake(px, py, radius, ch, kx, ky):
    """What is left of p (2) when a friction set takes what it can: p − the set's point nearest in its own sense."""
    if kx == 0.0 and ky == 0.0:
        size = np.sqrt(px * px + py * py)
        if size.real <= radius.real:
            return 0.0j, 0.0j
        left = 1.0 - radius / size
        return px * left, py * left
    if (ch * (px * px + py * py) - (kx * (px * px - py * py) + 2 * ky * px * py) - radius * radius).real <= 0.0:
        return 0.0j, 0.0j
    y = np.sqrt(px * px + py * py) - radius
    if y.real < 0.0:
        y = 0.0j + 1e-9
    a = b = 0.0j
    sh2 = kx * kx + ky * ky
    for _ in range(6):
        d = y + radius * ch
        det = d * d - radius * radius * sh2
        a = (d * px - radius * (kx * px + ky * py)) / det
        b = (d * py - radius * (ky * px - kx * py)) / det
        q = ch * (a * a + b * b) + kx * (a * a - b * b) + 2 * ky * a * b
        # d(a, b)/dy = −(yI + RM)⁻¹ (a, b)
        da = -(d * a - radius * (kx * a + ky * b)) / det
        db = -(d * b - radius * (ky * a - kx * b)) / det
        dq = 2 * (ch * (a * da + b * db) + kx * (a * da - b * db) + ky * (a * db + b * da))
        root = np.sqrt(q)
        step = -(1.0 / root - 1.0) / (-0.5 * dq / (q * root))
        y = y + step
        if abs(step) < 1e-12 * abs(y):
            break
    return y * a, y * b


@njit(cache=True)
def _slide(th, fact, frames, rows, t0, x, y, base, age, spread, sigma2, shape, told):
    """ln p of the frames of a slide that begins at t0 with the friction `base`, whose ln has the variance `spread`."""
    ch, kx, ky, cx, cy = shape
    out = np.zeros(5, np.complex128)
    ll = 0.0j
    k_sag = th[SAG]
    _pull(th, rows, t0, x, y, 0.0j, 0.0j, out)
    size = np.sqrt(out[0] ** 2 + out[1] ** 2)
    nu, s_w2, length = 2.0 + np.exp(th[NU]), np.exp(2 * th[SW]), 5e-4 + np.exp(th[LW])
    shake2 = np.exp(2 * th[SHAKE])
    m0, m1, m2, m3 = 0.0j, 0.0j, 0.0j, 0.0j
    p00, p01, p02, p03 = sigma2 / fact[5], 0.0j, 0.0j, 0.0j
    p11, p12, p13, p22, p23, p33 = 0.0j, 0.0j, 0.0j, 0.0j, 0.0j, spread
    ex, ey = out[0] / size, out[1] / size
    share = _speed(th, 0.0j) / age
    fx, fy = out[0] * share, out[1] * share
    vx, vy = 0.0j, 0.0j
    t = t0 + 0.0
    chi, count = 0.0, 0
    for i in range(len(frames)):
        until = frames[i, 0]
        if until > t0.real:
            pieces = math.ceil((until - t.real) / fact[19])
            dt = (until - t) / pieces
            for _ in range(pieces):
                mx, my = x + 0.5 * dt * vx, y + 0.5 * dt * vy
                _pull(th, rows, t + 0.5 * dt, mx, my, vx, vy, out)
                qx, qy = vx + 0.5 * dt * (out[0] - fx), vy + 0.5 * dt * (out[1] - fy)
                v = np.sqrt(qx * qx + qy * qy + 1e-16)
                law = _speed(th, v)
                radius = base * np.exp(_place(th, mx, my, fact[7])) * law * out[2]
                px, py = vx / dt + out[0] - radius * cx, vy / dt + out[1] - radius * cy
                nx, ny = _brake(px, py, radius, ch, kx, ky)
                fx, fy = out[0] + vx / dt - nx, out[1] + vy / dt - ny
                slow = dt / (1.0 + th[DRAG] * dt)
                nx, ny = nx * slow, ny * slow
                sum_x, sum_y = vx + nx, vy + ny
                x, y = x + 0.5 * dt * sum_x, y + 0.5 * dt * sum_y
                vx, vy = nx, ny
                t += dt
                if nx.real == 0.0 and ny.real == 0.0:  # at rest: what is known of its speed is nothing any more
                    m1, p01, p11, p12, p13 = 0.0j, 0.0j, 0.0j, 0.0j, 0.0j
                    continue
                far = np.sqrt(sum_x * sum_x + sum_y * sum_y)
                ex, ey = sum_x / far, sum_y / far
                drag = fx * ex + fy * ey
                slope = -th[DRAG]
                if th[SF] != 0.0 or th[RATE] != 0.0:
                    slope -= radius * (_speed(th, v + 1e-6) - law) / law / 1e-6
                # δs' = δs + dt δv + …, δv' = (1 + a dt) δv − dt drag (w + δU), w' = ρ w
                g = 1.0 + slope * dt
                b = -dt * drag
                rho = np.exp(-0.5 * dt * far / length)
                n1 = g * m1 + b * (m2 + m3)
                m0, m1, m2 = m0 + 0.5 * dt * (m1 + n1), n1, rho * m2
                # P after v' = g v + b (w + U)
                c01 = g * p01 + b * (p02 + p03)
                c11 = g * g * p11 + 2 * g * b * (p12 + p13) + b * b * (p22 + 2 * p23 + p33) + shake2 * dt
                cov = g * p11 + b * (p12 + p13)  # of v and v'
                c12, c13 = g * p12 + b * (p22 + p23), g * p13 + b * (p23 + p33)
                half = 0.5 * dt
                n00 = p00 + 2 * half * (p01 + c01) + half * half * (p11 + 2 * cov + c11)
                n01 = c01 + half * (cov + c11)
                n02 = p02 + half * (p12 + c12)
                n03 = p03 + half * (p13 + c13)
                p00, p01, p02, p03 = n00, n01, rho * n02, n03
                p11, p12, p13 = c11, rho * c12, c13
                p22, p23 = rho * rho * p22 + s_w2 * (1 - rho * rho), rho * p23
        _pull(th, rows, until, x, y, vx, vy, out)
        dx, dy = frames[i, 1] - x - k_sag * out[3], frames[i, 2] - y - k_sag * out[4]
        along, across = dx * ex + dy * ey - m0, dy * ex - dx * ey
        s = p00 + sigma2
        each, weight = _student(along, s, nu)
        ll += each
        each, _ = _student(across, sigma2 * (1 + 1 / fact[5]), nu)
        ll += each
        chi += (along * along / s + across * across / sigma2).real
        count += 2
        s = p00 + sigma2 / weight
        k0, k1, k2, k3 = p00 / s, p01 / s, p02 / s, p03 / s
        m0, m1, m2, m3 = m0 + k0 * along, m1 + k1 * along, m2 + k2 * along, m3 + k3 * along
        p11, p12, p13 = p11 - k1 * p01, p12 - k1 * p02, p13 - k1 * p03
        p22, p23, p33 = p22 - k2 * p02, p23 - k2 * p03, p33 - k3 * p03
        p00, p01, p02, p03 = p00 - k0 * p00, p01 - k0 * p01, p02 - k0 * p02, p03 - k0 * p03
    told[5], told[6] = chi, count
    return ll


@njit(cache=True)
def _delay(th, fact, rows, t0):
    """How much later a run slips than at t0 if the drop is not that (fact 21) for which t0 was found."""
    out = np.zeros(5, np.complex128)
    more = th[DROP] - fact[21]
    if more == 0.0:
        return 0.0j
    x, y = fact[1] + 0.0j, fact[2] + 0.0j
    _pull(th, rows, t0 - AROUND_S, x, y, 0.0j, 0.0j, out)
    sooner = (out[0] ** 2 + out[1] ** 2) / out[2] ** 2
    _pull(th, rows, t0 + AROUND_S, x, y, 0.0j, 0.0j, out)
    growth = 0.5 * np.log((out[0] ** 2 + out[1] ** 2) / out[2] ** 2 / sooner) / (2 * AROUND_S)
    if growth.real < SLOW_GROWTH:
        growth = SLOW_GROWTH + 0.0j
    return more / growth


@njit(cache=True)
def run_likelihood(th, fact, frames, rows, slip, keep, weight, told):
    """ln p of one run, summed over the cells around `slip` that are kept; `weight` takes each cell's share.

    `told` takes the mean delay after `slip` and its standard deviation (s), the run's friction, and the best path's
    chi² and count.
    """
    out = np.zeros(5, np.complex128)
    two_o, two_p = 2 * fact[6], 2 * fact[7]
    sx = th[OX] * math.cos(two_o) - th[OY] * math.sin(two_o) + th[PX] * math.cos(two_p) - th[PY] * math.sin(two_p)
    sy = th[OX] * math.sin(two_o) + th[OY] * math.cos(two_o) + th[PX] * math.sin(two_p) + th[PY] * math.cos(two_p)
    s2 = sx * sx + sy * sy
    ch = 1 + s2 / 2 * (1 + s2 / 12 * (1 + s2 / 30))
    sh = 1 + s2 / 6 * (1 + s2 / 20 * (1 + s2 / 42))
    kx, ky = sh * sx, sh * sy
    cp, sp, cb, sb = math.cos(fact[7]), math.sin(fact[7]), math.cos(fact[6]), math.sin(fact[6])
    cx = th[NX] * cp - th[NY] * sp + th[BX] * cb - th[BY] * sb
    cy = th[NX] * sp + th[NY] * cp + th[BX] * sb + th[BY] * cb
    k_sag, su2 = th[SAG], np.exp(2 * th[SU])
    sigma2 = (fact[11] * np.exp(th[SIG])) ** 2
    x, y = fact[1] - k_sag * fact[3], fact[2] - k_sag * fact[4]
    # --- before the slip: the start, and the plate's mark ---
    ll = -fact[5] * np.log(sigma2) - 0.5 * (fact[12] - 2 * k_sag * fact[13] + k_sag**2 * fact[14]) / sigma2
    if fact[15] > 0:
        fid2 = (fact[11] * np.exp(th[FIDSIG])) ** 2
        ll += -fact[15] * np.log(fid2) - 0.5 * (fact[16] - 2 * k_sag * fact[17] + k_sag**2 * fact[18]) / fid2
    if fact[10] > 0:  # no slip: friction was larger than this
        level, _, _ = _level(th, rows, fact, slip + 0.0j, x, y, ch, kx, ky, cx, cy, out)
        z = level / np.sqrt(su2)
        q = max(0.5 * math.erfc(z.real / math.sqrt(2.0)), 1e-300)
        slope = -math.exp(-0.5 * z.real**2) / math.sqrt(2 * math.pi) / q
        told[2] = level.real
        return ll + math.log(q) + 1j * slope * z.imag
    width = fact[20]
    middle = slip + _delay(th, fact, rows, slip + 0.0j)
    lls = np.empty(CELLS, np.complex128)
    top = -np.inf
    edge, _, age = _level(th, rows, fact, middle - 0.5 * CELLS * width, x, y, ch, kx, ky, cx, cy, out)
    for k in range(CELLS):
        at = middle + (k - 0.5 * (CELLS - 1)) * width
        after, _, age = _level(th, rows, fact, at + 0.5 * width, x, y, ch, kx, ky, cx, cy, out)
        grown = after - edge if after.real > edge.real else 0.0j
        level = edge + 0.5 * grown
        edge = edge + grown
        lls[k] = -np.inf + 0.0j
        if not keep[k]:
            continue
        share = 0.5 * (grown + np.sqrt(grown * grown + LEAST_GROWTH**2))
        first_passage = np.log(share) - 0.5 * level * level / su2 - 0.5 * np.log(2 * math.pi * su2)
        base = np.exp(th[MU] + level) * (1.0 - th[WEAR] * (1.0 - np.exp(-fact[9] / np.exp(th[WEARN]))))
        lls[k] = first_passage + _slide(
            th, fact, frames, rows, at, x, y, base, age, share * share / SMOOTH, sigma2, (ch, kx, ky, cx, cy), told
        )
        told[3] = told[5] if lls[k].real > top else told[3]
        told[4] = told[6] if lls[k].real > top else told[4]
        if lls[k].real > top:
            top, told[2] = lls[k].real, level.real
    total, mean, square = 0.0j, 0.0, 0.0
    for k in range(CELLS):
        each = np.exp(lls[k] - top) if keep[k] else 0.0j
        weight[k] = each.real
        total += each
        off = (k - 0.5 * (CELLS - 1)) * width
        mean, square = mean + each.real * off, square + each.real * off * off
    for k in range(CELLS):
        weight[k] /= total.real
    mean, square = mean / total.real, square / total.real
    told[0], told[1] = mean + (middle - slip).real, math.sqrt(max(square - mean * mean, 0.0))
    return ll + top + np.log(total)


@njit(cache=True)
def likelihoods(th, fact, frame, first, plate, row, slip, keep, weight, told, out):
    """Fills `out` (r,) with each run's ln p, linearised about slips at `slip` (r,) s after the tables' begins."""
    for i in range(len(fact)):
        out[i] = run_likelihood(
            th,
            fact[i],
            frame[first[i] : first[i + 1]],
            plate[row[i] : row[i + 1]],
            slip[i],
            keep[i],
            weight[i],
            told[i],
        )
