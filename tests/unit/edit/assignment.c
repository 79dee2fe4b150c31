/* SPDX-License-Identifier: MIT */
/* Assignments as people write them. */
#include "lib/farlight.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct fl_error error;

static struct fl_assignment parsed(const char *text)
{
    struct fl_assignment assignment;
    error = (struct fl_error){0};
    if (!fl_assignment_parse(text, &assignment, &error))
        fail_msg("'%s': %s (%s)", text, error.text, error.remedy);
    return assignment;
}

TEST(an_assignment_names_an_object_a_field_and_values)
{
    struct fl_assignment assignment = parsed("node.Door.rotate=0,30,-1.5");
    assert_int_equal(assignment.kind, PROTOCOL_OBJECT_NODE);
    assert_string_equal(assignment.which, "Door");
    assert_string_equal(assignment.field, "rotate");
    assert_int_equal(assignment.way, FL_ASSIGN);
    assert_int_equal(assignment.count, 3);
    assert_true(assignment.values[0] == 0 && assignment.values[1] == 30 && assignment.values[2] == -1.5);
    assignment = parsed(" light.Sun.intensity *= 2 ");
    assert_int_equal(assignment.kind, PROTOCOL_OBJECT_LIGHT);
    assert_int_equal(assignment.way, FL_ASSIGN_PRODUCT);
    assert_true(assignment.values[0] == 2);
    assert_int_equal(parsed("light.Sun.intensity+=2").way, FL_ASSIGN_SUM);
    assignment = parsed("material.Glass.alpha_mode=blend");
    assert_true(assignment.values[0] == PROTOCOL_ALPHA_BLEND);
}

TEST(names_may_have_dots_blanks_and_equals_signs)
{
    assert_string_equal(parsed("material.Brushed Steel.001.roughness = 0.2").which, "Brushed Steel.001");
    assert_string_equal(parsed("material.a=b.c=d.roughness=0.2").which, "a=b.c=d");
    assert_string_equal(parsed("hide=Roof.001").which, "Roof.001");
    assert_string_equal(parsed("node.#7.hidden=true").which, "#7");
}

TEST(hide_and_show_are_a_node_s_field)
{
    struct fl_assignment assignment = parsed("hide=Roof");
    assert_int_equal(assignment.kind, PROTOCOL_OBJECT_NODE);
    assert_string_equal(assignment.field, "hidden");
    assert_true(assignment.values[0] == 1);
    assert_true(parsed("show = Roof").values[0] == 0);
}

TEST(a_colour_may_be_that_of_a_display)
{
    struct fl_assignment assignment = parsed("material.Paint.base_colour=#ff8000");
    assert_int_equal(assignment.count, 3);
    /* IEC 61966-2-1 of 128 / 255 is 0.21586. */
    assert_true(assignment.values[0] == 1 && assignment.values[2] == 0);
    assert_float_equal((float)assignment.values[1], 0.21586f, 1e-5f);
    assert_int_equal(parsed("material.Paint.base_colour=1,0.5,0,0.25").count, 4);
    assert_int_equal(parsed("material.Paint.specular_colour=0.5").count, 1);
}

TEST(what_is_wrong_is_named_with_a_remedy)
{
    static const struct {
        const char *text, *what, *remedy;
    } wrong[] = {
        {"", "is no assignment", "hide=Roof"},
        {"material", "is no assignment", "hide=Roof"},
        {"material.Steel", "is no assignment", "hide=Roof"},
        {"material.roughness=1", "is no assignment", "hide=Roof"},
        {"hide=", "is no assignment", "hide=Roof"},
        {"=", "is no assignment", "hide=Roof"},
        {".=", "'' is no kind", "material"},
        {"materiel.Steel.roughness=1", "'materiel' is no kind", "did you mean 'material'?"},
        {"mesh.Steel.roughness=1", "'mesh' is no kind", "material, node, light, camera and environment"},
        {"environment=1", "is no assignment", "environment.rotation=90"},
        {"environment.rotaton=1", "an environment has no field 'rotaton'", "did you mean 'rotation'?"},
        {"environment.sky.intensity=1", "no field 'sky.intensity'",
         "intensity, colour, rotation, backdrop, display_values"},
        {"material.Steel.roughnes=1", "no field 'roughnes'", "did you mean 'roughness'?"},
        {"node.Door.angle=1", "no field 'angle'", "translate, rotate, scale, hidden"},
        {"material.Steel.roughness=", "not a valid value of roughness", "a number"},
        {"material.Steel.roughness=nan", "not a valid value of roughness", "a number"},
        {"material.Steel.roughness=1,2", "not a valid value of roughness", "a number"},
        {"material.Steel.roughness=1.01", "roughness is 1.01, but must be 0 to 1", ""},
        {"node.Door.rotate=30", "not a valid value of rotate", "3 numbers"},
        {"node.Door.rotate=1,2,", "not a valid value of rotate", "3 numbers"},
        {"node.Door.matrix=1,2,3,4,5,6,7,8,9,10,11,12,13", "not a valid value of matrix", "12 numbers"},
        {"node.Door.hidden=maybe", "'maybe' does not say", "true or false"},
        {"node.Door.hidden+=1", "hidden is no number", ""},
        {"material.Steel.alpha_mode=clear", "'clear' is no alpha_mode", "opaque, mask, blend"},
        {"material.Steel.base_colour=#ff80", "'#ff80' is not a colour", ""},
    };
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        struct fl_assignment assignment;
        error = (struct fl_error){0};
        if (fl_assignment_parse(wrong[i].text, &assignment, &error))
            fail_msg("'%s' was taken", wrong[i].text);
        assert_int_equal(error.code, FL_ERROR_ARGUMENT);
        assert_string_equal(error.field, wrong[i].text);
        if (!strstr(error.text, wrong[i].what) || !strstr(error.remedy, wrong[i].remedy))
            fail_msg("'%s': %s (%s)", wrong[i].text, error.text, error.remedy);
    }
}

TEST(long_names_and_lines_are_refused)
{
    char text[2000];
    struct fl_assignment assignment;
    snprintf(text, sizeof(text), "hide=%0128d", 0);
    assert_int_equal(strlen(parsed(text).which), 128);
    snprintf(text, sizeof(text), "hide=%0129d", 0);
    assert_false(fl_assignment_parse(text, &assignment, &error));
    snprintf(text, sizeof(text), "hide=%01500d", 0);
    assert_false(fl_assignment_parse(text, &assignment, &error));
    assert_int_equal(error.code, FL_ERROR_ARGUMENT);
}

TEST(what_is_printed_is_read_as_the_same)
{
    static const char *const texts[] = {"material.Brushed Steel.001.roughness=0.2",
                                        "node.#7.rotate+=0,30,-1.5",
                                        "light.Sun.intensity*=2",
                                        "material.a=b.alpha_mode=mask",
                                        "node.Door.hidden=1",
                                        "node.0.matrix=1,0,0,0,0,1,0,0,0,0,1,0.33333334",
                                        "material.*.emission=1e+06,0,3.1415927",
                                        "environment.intensity*=2",
                                        "environment.colour=1,0.5,0.25"};
    for (size_t i = 0; i < sizeof(texts) / sizeof(texts[0]); i++) {
        const struct fl_assignment first = parsed(texts[i]);
        char text[400];
        assert_string_equal(fl_assignment_print(&first, text, sizeof(text)), texts[i]);
    }
    char small[8];
    const struct fl_assignment assignment = parsed(texts[0]);
    assert_string_equal(fl_assignment_print(&assignment, small, sizeof(small)), "materia");
}
