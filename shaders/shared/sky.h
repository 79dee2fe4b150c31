/* SPDX-License-Identifier: MIT */
/* Default light of a scene that has neither a light nor an environment. Radiances, linear. */
#ifndef FARLIGHT_SHARED_SKY_H
#define FARLIGHT_SHARED_SKY_H

#define SKY_ZENITH 0.15f, 0.20f, 0.30f
#define SKY_HORIZON 0.34f, 0.36f, 0.38f
#define SKY_GROUND 0.10f, 0.095f, 0.09f
#define SKY_GROUND_SLOPE 4.0f /* slope below the horizon at which the ground colour is reached */
/* Lights of a studio for a camera that looks along -z: the sky fills; a key light from above right in front; a
 * rim light from above left behind, so that white objects stand out against the background. Directions in which
 * the light travels (unit length) and irradiances. */
#define SKY_LIGHTS 2
#define SKY_KEY_DIRECTION -0.48f, -0.64f, -0.60f
#define SKY_KEY_IRRADIANCE 2.3f, 2.2f, 2.0f
#define SKY_RIM_DIRECTION 0.60f, -0.48f, 0.64f
#define SKY_RIM_IRRADIANCE 0.8f, 0.9f, 1.0f

#endif
