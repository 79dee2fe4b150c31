/* SPDX-License-Identifier: MIT */
/* The light of a scene that has none of its own: no light, no environment. Radiances, linear. */
#ifndef FARLIGHT_SHARED_SKY_H
#define FARLIGHT_SHARED_SKY_H

#define SKY_ZENITH 0.15f, 0.20f, 0.30f
#define SKY_HORIZON 0.34f, 0.36f, 0.38f
#define SKY_GROUND 0.10f, 0.095f, 0.09f
#define SKY_GROUND_SLOPE 4.0f /* the ground is reached this steeply below the horizon */
/* As in a studio, for a camera that looks along -z: the sky fills; a key from above right in front; and from above
 * left behind a rim, so that what is white does not melt into what is behind. The ways that the light goes (unit
 * length) and irradiances. */
#define SKY_LIGHTS 2
#define SKY_KEY_DIRECTION -0.48f, -0.64f, -0.60f
#define SKY_KEY_IRRADIANCE 2.3f, 2.2f, 2.0f
#define SKY_RIM_DIRECTION 0.60f, -0.48f, 0.64f
#define SKY_RIM_IRRADIANCE 0.8f, 0.9f, 1.0f

#endif
