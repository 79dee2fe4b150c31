// SPDX-License-Identifier: MIT
// Colour conversions by OpenColorIO configurations.
#include "colour.hpp"

#include <OpenImageIO/color.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>
#include <vector>

namespace
{

// Names of linear Rec. 709 in configurations without the role aces_interchange: ACES 1, nuke-default, spi,
// Blender.
const char *const linear_names[] = {"Linear Rec.709 (sRGB)",   "lin_rec709_srgb", "lin_rec709",  "Linear Rec.709",
                                    "Utility - Linear - sRGB", "lin_srgb",        "linear_srgb", "Linear"};
constexpr size_t NAMES_BYTES = 360; // fits into a message

OIIO::ColorProcessorHandle processor;
bool comes_by_aces;
float aces_from_rec709[9];

bool refuse(char *reason, size_t reason_bytes, const std::string &text)
{
    std::snprintf(reason, reason_bytes, "%s", text.c_str());
    return false;
}

bool knows(const OIIO::ColorConfig &config, const std::string &name)
{
    for (const std::string &each : config.getColorSpaceNames()) {
        const std::vector<std::string> aliases = config.getAliases(each);
        if (each == name || std::find(aliases.begin(), aliases.end(), name) != aliases.end())
            return true;
    }
    return false;
}

bool has(const std::vector<std::string> &names, const std::string &name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

std::string listed(const std::vector<std::string> &names)
{
    std::string text;
    for (size_t i = 0; i < names.size(); i++) {
        if (text.size() + names[i].size() > NAMES_BYTES)
            return text + " and " + std::to_string(names.size() - i) + " more";
        text += (i > 0 ? ", " : "") + names[i];
    }
    return text;
}

std::string source_of(const OIIO::ColorConfig &config)
{
    if (has(config.getRoles(), "aces_interchange")) {
        comes_by_aces = true;
        return "aces_interchange";
    }
    for (const char *name : linear_names)
        if (has(config.getColorSpaceNames(), name))
            return name;
    return "";
}

// Finds "DISPLAY/VIEW", or a view of the default display.
bool find_view(const OIIO::ColorConfig &config, const std::string &wanted, std::string &display, std::string &view)
{
    const char *usual = config.getDefaultDisplayName();
    display = usual ? usual : "";
    view = wanted;
    if (has(config.getViewNames(display), view))
        return true;
    const size_t slash = wanted.find('/');
    if (slash == std::string::npos)
        return false;
    display = wanted.substr(0, slash);
    view = wanted.substr(slash + 1);
    return has(config.getDisplayNames(), display) && has(config.getViewNames(display), view);
}

std::vector<std::string> views_of(const OIIO::ColorConfig &config)
{
    std::vector<std::string> names;
    for (const std::string &display : config.getDisplayNames())
        for (const std::string &view : config.getViewNames(display))
            names.push_back(display + "/" + view);
    return names;
}

bool open_colours(const struct library_colour &wanted, char *reason, size_t reason_bytes)
{
    OIIO::ColorConfig config(wanted.config);
    if (config.has_error())
        return refuse(reason, reason_bytes, std::string(wanted.config) + ": " + config.geterror());
    const std::string source = source_of(config);
    if (source.empty())
        return refuse(reason, reason_bytes,
                      std::string(wanted.config) +
                          " has neither the role aces_interchange nor linear Rec. 709 by a known "
                          "name; it has: " +
                          listed(config.getColorSpaceNames()));
    if (wanted.space) {
        if (!knows(config, wanted.space) && !has(config.getRoles(), wanted.space))
            return refuse(reason, reason_bytes,
                          std::string(wanted.config) + " has no colour space '" + wanted.space +
                              "'; it has: " + listed(config.getColorSpaceNames()));
        processor = config.createColorProcessor(source, wanted.space);
    } else {
        std::string display, view;
        if (!find_view(config, wanted.view, display, view))
            return refuse(reason, reason_bytes,
                          std::string(wanted.config) + " has no view '" + wanted.view +
                              "'; it has: " + listed(views_of(config)));
        processor = config.createDisplayTransform(display, view, source);
    }
    return processor || refuse(reason, reason_bytes, std::string(wanted.config) + ": " + config.geterror());
}

} // namespace

bool colour_open_configuration(const struct library_colour *wanted, char *reason, size_t reason_bytes)
{
    std::copy_n(wanted->aces_from_rec709, 9, aces_from_rec709);
    try {
        return open_colours(*wanted, reason, reason_bytes);
    } catch (const std::exception &exception) {
        return refuse(reason, reason_bytes, std::string(wanted->config) + ": " + exception.what());
    }
}

void colour_apply_to(float *pixels, size_t count)
{
    for (size_t i = 0; i < count && comes_by_aces; i++) {
        float *pixel = pixels + 4 * i;
        const float rgb[3] = {pixel[0], pixel[1], pixel[2]};
        for (size_t k = 0; k < 3; k++)
            pixel[k] = aces_from_rec709[3 * k] * rgb[0] + aces_from_rec709[3 * k + 1] * rgb[1] +
                       aces_from_rec709[3 * k + 2] * rgb[2];
    }
    processor->apply(pixels, static_cast<int>(count), 1, 3, sizeof(float), 4 * sizeof(float),
                     static_cast<OIIO::stride_t>(4 * sizeof(float) * count));
}
