"""`gi.blur` and `gi.atrous` (shaders/gi/gather) as torch computes them, with what a network says of each cell. The shaders average light with
its direction, this the light along each cell's own normal: where surfaces are curved the two differ by a thousandth."""
import torch
import torch.nn.functional as F

LUMINANCE = (0.2126, 0.7152, 0.0722)
# Of shaders/gi/gather/blur.wgsl, types.wgsl and atrous.wgsl.
WIDE_BLUR_FRAMES, NARROW_RADIUS, WIDE_RADIUS, SPP_INVALIDATED, ATROUS_STRIDE = 5, 2, 4, 4, 4
# Of history.wgsl and blur.wgsl: a nearness that is none; a plane that is another surface's; what is seen as a blotch, and how few rays are few.
PROXIMITY_FLOOR, LEAST_COSINE_OF_PLANE, FIREFLY_CONTRAST, FIREFLY_MIN_RAYS, FIREFLY_MAX_RAYS = 0.01, 0.5, 0.1, 4.0, 8.0
# Of shaders/gi/gather/guidance.wgsl: numbers of a cell (two are not read), frames up to which they count in full, and their limit.
GUIDANCE, GUIDED_FRAMES, MAX_LOG = 12, 32.0, 4.0
# Where they stand.
PARTS = {"near": slice(0, 4), "far": slice(4, 8), "trust": slice(8, 9), "tolerance": slice(9, 10)}


def luminance(rgb):
    """[n,3,h,w] to [n,h,w]."""
    r, g, b = LUMINANCE
    return r * rgb[:, 0] + g * rgb[:, 1] + b * rgb[:, 2]


def bounded_ratio(a, b, most):
    """a / b of b >= 0, no more than `most`, with finite slopes however small b is: those of a quotient that is cut afterwards are 0 times infinity."""
    return a / torch.maximum(b, a / most).clamp(min=1e-30)


def around(x, radius, stride=1):
    """[n,c,h,w] to [n,c,k,h,w]: the k cells of the square around each, 0 outside."""
    n, c, h, w = x.shape
    k = 2 * radius + 1
    return F.unfold(x, k, dilation=stride, padding=radius * stride).view(n, c, k * k, h, w)


def plane_side(batch):
    """[n,3,h,w]: the side that each cell's plane shows, from the places of the cells beside it (`plane_normal` of history.wgsl)."""
    x, normal = batch["x"], batch["n"]
    there = (around(batch["frames"].unsqueeze(1), 1) > 0) & ((around(normal, 1) * normal.unsqueeze(2)).sum(1, keepdim=True) > LEAST_COSINE_OF_PLANE)
    steps = (around(x, 1) - x.unsqueeze(2)) * there

    def nearer(back, ahead):
        b, a = (back * back).sum(1, keepdim=True), (ahead * ahead).sum(1, keepdim=True)
        return torch.where((b > 0) & ((b < a) | (a == 0)), -back, ahead)

    # Rows of three: above, beside, below.
    across, down = nearer(steps[:, :, 3], steps[:, :, 5]), nearer(steps[:, :, 1], steps[:, :, 7])
    side = torch.linalg.cross(across, down, dim=1)
    size = (side * side).sum(1, keepdim=True)
    flat = size <= 1e-12 * (across * across).sum(1, keepdim=True) * (down * down).sum(1, keepdim=True)
    unit = side * size.clamp(min=1e-38).rsqrt()
    cosine = (unit * normal).sum(1, keepdim=True)
    return torch.where(flat | (cosine.abs() <= LEAST_COSINE_OF_PLANE), normal, unit * cosine.sign())


def surface_weight(batch, radius, stride):
    """[n,k,h,w]: how much the cells around lie in the cell's plane and face its way; 0 where they show nothing."""
    x, normal = batch["x"], batch["n"]
    to = around(x, radius, stride) - x.unsqueeze(2)
    off_plane = (to * plane_side(batch).unsqueeze(2)).sum(1) * batch["strictness"].unsqueeze(1)
    facing = (around(normal, radius, stride) * normal.unsqueeze(2)).sum(1).clamp(0, 1)
    there = around(batch["frames"].unsqueeze(1), radius, stride)[:, 0] > 0
    return torch.exp(-(off_plane * off_plane).clamp(max=80)) * facing ** 16 * there


def guided_share(batch):
    """[n,h,w]: how much guidance counts."""
    return (GUIDED_FRAMES / batch["frames"].clamp(min=1)).clamp(max=1)


def affinity(place, share, radius, stride):
    """[n,k,h,w] of places [n,4,h,w]."""
    apart = share.view(len(share), 1, 1, *share.shape[1:]) * (around(place, radius, stride) - place.unsqueeze(2))
    return 1 / (1 + (apart * apart).sum(1)) ** 2


def as_near(batch, radius, stride):
    """[n,k,h,w]: whether as much is near to the cells around as to each, as far as their rays can tell."""
    nearness = batch["nearness"]
    chance = nearness * (1 - nearness) / batch["frames"].clamp(min=1) + PROXIMITY_FLOOR ** 2
    apart = around(nearness.unsqueeze(1), radius, stride)[:, 0] - nearness.unsqueeze(1)
    chance = around(chance.unsqueeze(1), radius, stride)[:, 0] + chance.unsqueeze(1)
    return torch.exp(-(0.5 * apart * apart / chance).clamp(max=60))


def without_fireflies(w, light, square, frames, total):
    """Share of each neighbour [n,k,h,w] that is kept: none of what few bright rays have brought, where it would be seen."""
    bright = luminance(light)
    rays = frames * bright * bright / square.clamp(min=1e-30)
    most, place = torch.where(rays < FIREFLY_MAX_RAYS, w * bright, 0.0).max(1)
    weight = torch.where(most > 0, w.gather(1, place.unsqueeze(1))[:, 0], 0.0)
    others = ((w * bright).sum(1) - most) / (total - weight).clamp(min=1e-30)
    seen = most - others * weight > FIREFLY_CONTRAST * others * total
    brings = bounded_ratio(w * (bright - others.unsqueeze(1)), (others * total).unsqueeze(1), 4 * FIREFLY_CONTRAST)
    fireflies = (brings / FIREFLY_CONTRAST - 1).clamp(0, 1) * ((FIREFLY_MAX_RAYS - rays) / (FIREFLY_MAX_RAYS - FIREFLY_MIN_RAYS)).clamp(0, 1)
    return 1 - fireflies * seen.unsqueeze(1)


def blur(batch, near, trust):
    """Mean light [n,3,h,w] over neighbours, the variance [n,h,w] of its luminance, and which part of it [n,3,h,w] few rays have brought."""
    narrow = (batch["age"].view(-1, 1, 1) > WIDE_BLUR_FRAMES).expand_as(batch["frames"])
    # What is older than this everywhere need not be asked, which a GPU would have to be waited for.
    radius = NARROW_RADIUS if batch.get("narrow") or narrow.all() else WIDE_RADIUS
    with torch.no_grad():
        steps = torch.arange(-radius, radius + 1, device=narrow.device)
        reach = torch.maximum(steps.abs().view(-1, 1), steps.abs().view(1, -1)).reshape(1, -1, 1, 1)
        own = (WIDE_RADIUS - (WIDE_RADIUS - NARROW_RADIUS) * narrow.int()).unsqueeze(1)
        rows, columns = steps.abs().view(-1, 1).expand(-1, 2 * radius + 1).reshape(1, -1, 1, 1), steps.abs().repeat(2 * radius + 1).view(1, -1, 1, 1)
        rim = torch.where(rows == own, 0.5, 1.0) * torch.where(columns == own, 0.5, 1.0) * (reach <= own)
        frames = around(batch["frames"].unsqueeze(1), radius)[:, 0]
        fixed = rim * surface_weight(batch, radius, 1) * as_near(batch, radius, 1) * frames.clamp(SPP_INVALIDATED, 16)
        light, square = around(batch["light"], radius), around(batch["square"].unsqueeze(1), radius)[:, 0]
    share = guided_share(batch)
    w = fixed * affinity(near, share, radius, 1) * torch.exp(share.unsqueeze(1) * around(trust.unsqueeze(1), radius)[:, 0])
    total = w.sum(1).clamp(min=1e-30)
    mean = (w.unsqueeze(1) * light).sum(2) / total.unsqueeze(1)
    w = w * without_fireflies(w, light, square, frames, total)
    total = w.sum(1).clamp(min=1e-30)
    kept = (w.unsqueeze(1) * light).sum(2) / total.unsqueeze(1)
    fireflies = (1 - kept / mean.clamp(min=1e-30)).clamp(0, 1)
    # A byte, as the shaders hand it on.
    fireflies = fireflies + (torch.floor(fireflies * 255 + 0.5) / 255 - fireflies).detach()
    squares = (w * square).sum(1) / total
    parts = (w * w / frames.clamp(min=1)).sum(1) / (total * total).clamp(min=1e-30)
    return mean, (squares - luminance(kept) ** 2).clamp(min=0) * parts, fireflies


def atrous(batch, mean, variance, fireflies, far, tolerance):
    """One à-trous step over cells that differ by no more than noise; what few rays have brought over all of the surface."""
    taps = mean.new_tensor([1 / 6, 2 / 3, 1, 2 / 3, 1 / 6])
    weights = (taps.view(-1, 1) * taps.view(1, -1)).reshape(1, -1, 1, 1)
    mean, fireflies = (1 - fireflies) * mean, fireflies * mean
    bright = luminance(mean)
    apart = around(bright.unsqueeze(1), 2, ATROUS_STRIDE)[:, 0] - bright.unsqueeze(1)
    share = guided_share(batch)
    noise = 2 * torch.exp(share * tolerance).unsqueeze(1) * (variance.unsqueeze(1) + around(variance.unsqueeze(1), 2, ATROUS_STRIDE)[:, 0])
    with torch.no_grad():
        surface = surface_weight(batch, 2, ATROUS_STRIDE)
        surface[:, 12] = 0
        same = weights * surface * as_near(batch, 2, ATROUS_STRIDE)
    w = same * torch.exp(-bounded_ratio(apart * apart, noise, 60)) * affinity(far, share, 2, ATROUS_STRIDE)
    spread = (fireflies + (surface.unsqueeze(1) * around(fireflies, 2, ATROUS_STRIDE)).sum(2)) / (1 + surface.sum(1)).unsqueeze(1)
    return spread + (mean + (w.unsqueeze(1) * around(mean, 2, ATROUS_STRIDE)).sum(2)) / (1 + w.sum(1)).unsqueeze(1)


def filtered(batch, answer=None):
    """Light [n,3,h,w] that the filter shows, and the mean of its first step. `answer` [n,12,h,w]; None: zeros."""
    if answer is None:
        answer = batch["frames"].new_zeros(len(batch["frames"]), GUIDANCE, *batch["frames"].shape[1:])
    near, far = answer[:, PARTS["near"]], answer[:, PARTS["far"]]
    trust, tolerance = (answer[:, PARTS[part]][:, 0].clamp(-MAX_LOG, MAX_LOG) for part in ("trust", "tolerance"))
    mean, variance, fireflies = blur(batch, near, trust)
    # A difference of means squared over a variance of nothing has no slope worth having.
    least = 1e-8 * (luminance(mean) ** 2).detach()
    return atrous(batch, mean, torch.maximum(variance, least), fireflies, far, tolerance), mean
