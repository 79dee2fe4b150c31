/* SPDX-License-Identifier: MIT */
/* Rules of tracers.def, checked for every row of it. */
#include "protocol/describe.h"
#include "protocol/tracers.h"

#include "tests/harness/test.h"

#include <string.h>

static const struct field_desc *first_field(void)
{
    return struct_field(message_describe(MESSAGE_RENDER)->body(), "tracing")->record()->fields;
}

TEST(every_setting_belongs_to_a_tracer_and_is_named_after_it)
{
    size_t settings = 0;
    for (const struct field_desc *field = first_field(); field->name; field++) {
        size_t owners = 0;
        for (size_t i = 0; field->tracer && i < tracer_desc_count; i++)
            owners += strcmp(tracer_descs[i].name, field->tracer) == 0;
        if (!field->tracer)
            continue;
        settings++;
        assert_int_equal(owners, 1);
        assert_memory_equal(field->name, field->tracer, strlen(field->tracer));
        assert_int_equal(field->name[strlen(field->tracer)], '_');
        assert_true(field->doc[0] != '\0');
    }
    assert_int_equal(settings * sizeof(uint32_t), sizeof(struct tracer_settings));
}

TEST(tracers_have_the_numbers_and_names_of_their_enumeration)
{
    for (size_t i = 0; i < tracer_desc_count; i++) {
        const struct tracer_desc *tracer = &tracer_descs[i];
        assert_ptr_equal(tracer_describe(tracer->number), tracer);
        assert_string_equal(protocol_tracer_text((enum protocol_tracer)tracer->number), tracer->name);
    }
    assert_null(tracer_describe(PROTOCOL_TRACER_COUNT));
}

TEST(zero_is_the_default_of_every_setting)
{
    struct setting_fault fault;
    struct tracer_settings settings = {0};
    struct message message;
    assert_true(tracer_settings_check(&settings, "", &fault));
    assert_string_equal(fault.text, "");
    tracer_settings_resolve(&settings);
    assert_true(tracer_settings_check(&settings, "", &fault));
    message_init(&message, MESSAGE_RENDER);
    assert_memory_equal(&settings, &message.render.tracing.settings, sizeof(settings));
    assert_true(settings.quadtree.pixels == 0.25f);
    assert_int_equal(settings.ldc.resolution, 0); /* the tracer chooses */
}

static void expect_fault(const struct tracer_settings *settings, const char *prefix, const char *field,
                         const char *text, const char *remedy)
{
    struct setting_fault fault;
    assert_false(tracer_settings_check(settings, prefix, &fault));
    assert_string_equal(fault.field, field);
    if (!strstr(fault.text, text) || !strstr(fault.remedy, remedy))
        fail_msg("got \"%s\" (%s)", fault.text, fault.remedy);
}

TEST(a_wrong_setting_is_reported_with_its_name_and_what_is_allowed)
{
    expect_fault(&(struct tracer_settings){.ldc = {.resolution = 15}}, "render.", "render.ldc_resolution",
                 "15 is not one of auto, 16 to 4096", "");
    expect_fault(&(struct tracer_settings){.abuffer = {.voxels = 100}}, "--", "--abuffer-voxels",
                 "100 is not one of auto, 16, 32, 64, 128, 256", "");
    expect_fault(&(struct tracer_settings){.bvh = {.form = 9}}, "", "bvh_form", "fast, paper", "");
}

TEST(settings_that_contradict_each_other_are_reported_with_both_names)
{
    struct setting_fault fault;
    struct tracer_settings settings = {.abuffer.voxels = 64};
    assert_true(tracer_settings_check(&settings, "--", &fault)); /* the tracer chooses the number of texels */
    settings.abuffer.resolution = 32;
    expect_fault(&settings, "render.", "render.abuffer_voxels",
                 "64 is more than the 32 texels of abuffer_resolution", "higher abuffer_resolution");
}
