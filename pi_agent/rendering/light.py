"""Turns reflectance into pixel values: illumination, noise and tone curve."""

import numpy as np
from numpy.typing import NDArray

from pi_agent.rendering.scene import FRAME_PX, Scene, Sensor

Image = NDArray[np.float32]
Frame = NDArray[np.uint8]

TONE_STEPS = 4096


def illumination(scene: Scene) -> tuple[Image, Image]:
    """Returns the factor (h, w) on reflectance by light, vignetting and shadows, and the glare (h, w) that is added."""
    y, x = np.mgrid[0:FRAME_PX, 0:FRAME_PX].astype(np.float32)
    cx, cy = scene.optics.centre_px
    radius2 = ((x - cx) ** 2 + (y - cy) ** 2) / (2 * (FRAME_PX / 2) ** 2)
    gain = scene.light * (1.0 - scene.optics.vignetting * radius2)
    for shadow in scene.shadows:
        along = x * np.cos(shadow.angle_rad) + y * np.sin(shadow.angle_rad) - shadow.offset_px
        depth = 0.5 * (1.0 + np.tanh(along / max(shadow.soft_px, 1e-3)))
        gain = gain * (1.0 - (1.0 - shadow.light) * depth)
    glare = np.zeros_like(x)
    for spot in scene.glare:
        distance2 = (x - spot.x_px) ** 2 + (y - spot.y_px) ** 2
        glare += spot.strength * np.exp(-distance2 / (2 * spot.radius_px**2))
    return gain.astype(np.float32), glare.astype(np.float32)


def tone_table(sensor: Sensor) -> NDArray[np.float32]:
    """Returns pixel values (TONE_STEPS,), not rounded, of light in steps of 1 / (TONE_STEPS − 1)."""
    return sensor.tone.to_value(np.linspace(0.0, 1.0, TONE_STEPS, dtype=np.float32)).astype(np.float32)


def expose(light: Image, normal: Image, *, sensor: Sensor, table: NDArray[np.float32]) -> Frame:
    """Returns pixel values (h, w) of light with shot and read noise.

    Args:
        light: (h, w) light on the sensor, 1 at full scale.
        normal: (h, w) normal deviates.
        sensor: the noise of the sensor.
        table: (n,) what `tone_table` gives, pixel values.
    """
    signal = np.maximum(light, 0.0)
    deviation = np.sqrt(signal * (1.0 / sensor.full_scale_e) + (sensor.read_noise_e / sensor.full_scale_e) ** 2)
    noisy = signal + deviation * normal
    if sensor.tone.is_linear:
        return np.clip(noisy * 255.0 + 0.5, 0.0, 255.0).astype(np.uint8)
    index = np.clip(noisy * (TONE_STEPS - 1) + 0.5, 0, TONE_STEPS - 1).astype(np.int32)
    return (table[index] + 0.5).astype(np.uint8)
