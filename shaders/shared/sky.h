/* SPDX-License-Identifier: MIT */
/* The light of a scene that has none of its own: no light, no environment. Radiances, linear. */
#ifndef FARLIGHT_SHARED_SKY_H
#define FARLIGHT_SHARED_SKY_H

#define SKY_ZENITH 0.20f, 0.28f, 0.44f
#define SKY_HORIZON 0.46f, 0.49f, 0.52f
#define SKY_GROUND 0.13f, 0.12f, 0.11f
#define SKY_GROUND_SLOPE 4.0f /* the ground is reached this steeply below the horizon */
/* A sun from above right in front of a camera that looks along -z: the way the light goes (unit length) and its
 * irradiance. */
#define SKY_KEY_DIRECTION -0.48f, -0.64f, -0.60f
#define SKY_KEY_IRRADIANCE 2.0f, 1.9f, 1.7f

#endif
