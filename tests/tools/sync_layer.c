/* SPDX-License-Identifier: MIT */
/* A Vulkan layer between Mesa's zink and Khronos' validation layer, for check_sync.py. zink emits two kinds of
 * barriers between shaders: those of glMemoryBarrier() by vkCmdPipelineBarrier(), and by vkCmdPipelineBarrier2()
 * others of its own, from what it has bound. OpenGL does not promise the latter, and another driver has none; they
 * are left out, so that the validation finds where a glMemoryBarrier() is missing. FARLIGHT_SYNC_DROP_ALL leaves
 * out those of glMemoryBarrier() as well: then it must find something. When the process ends, FARLIGHT_SYNC_COUNTS
 * (a file) gets a line with what was seen.
 *
 * One instance and one device at a time, whose functions are those of the next layer. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

/* The validation layer of Vulkan 1.3.239 crashes on pipelines of libraries whose vertex input is dynamic. */
#define HIDDEN_EXTENSION "VK_EXT_graphics_pipeline_library"
#define EXTENSIONS_MAX 512

/* Accesses that only glMemoryBarrier() orders in GL. The driver orders copies, the host and framebuffers. */
#define SHADER_ACCESSES                                                                                           \
    (VK_ACCESS_2_INDIRECT_COMMAND_READ_BIT | VK_ACCESS_2_INDEX_READ_BIT | VK_ACCESS_2_VERTEX_ATTRIBUTE_READ_BIT | \
     VK_ACCESS_2_UNIFORM_READ_BIT | VK_ACCESS_2_SHADER_READ_BIT | VK_ACCESS_2_SHADER_WRITE_BIT)

static PFN_vkGetInstanceProcAddr next_of_instance;
static PFN_vkGetDeviceProcAddr next_of_device;
static PFN_vkEnumerateDeviceExtensionProperties next_extensions;
static PFN_vkCmdPipelineBarrier next_barrier;
static PFN_vkCmdPipelineBarrier2 next_barrier2;
static PFN_vkCmdDispatch next_dispatch;
static PFN_vkCmdDispatchIndirect next_dispatch_indirect;
static unsigned long dispatches, kept, dropped;
static int drops_all;

static VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo *info,
                                                      const VkAllocationCallbacks *allocator, VkInstance *instance)
{
    /* The loader's own structure, in which each layer moves on to the next one. */
    VkLayerInstanceCreateInfo *link = (VkLayerInstanceCreateInfo *)info->pNext;
    while (link &&
           !(link->sType == VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO && link->function == VK_LAYER_LINK_INFO))
        link = (VkLayerInstanceCreateInfo *)link->pNext;
    if (!link)
        return VK_ERROR_INITIALIZATION_FAILED;
    next_of_instance = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    PFN_vkCreateInstance create = (PFN_vkCreateInstance)next_of_instance(NULL, "vkCreateInstance");
    const VkResult result = create(info, allocator, instance);
    if (result == VK_SUCCESS)
        next_extensions = (PFN_vkEnumerateDeviceExtensionProperties)next_of_instance(
            *instance, "vkEnumerateDeviceExtensionProperties");
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo *info,
                                                    const VkAllocationCallbacks *allocator, VkDevice *device)
{
    VkLayerDeviceCreateInfo *link = (VkLayerDeviceCreateInfo *)info->pNext;
    while (link &&
           !(link->sType == VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO && link->function == VK_LAYER_LINK_INFO))
        link = (VkLayerDeviceCreateInfo *)link->pNext;
    if (!link)
        return VK_ERROR_INITIALIZATION_FAILED;
    PFN_vkGetInstanceProcAddr of_instance = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    next_of_device = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    PFN_vkCreateDevice create = (PFN_vkCreateDevice)of_instance(NULL, "vkCreateDevice");
    const VkResult result = create(physical, info, allocator, device);
    if (result != VK_SUCCESS)
        return result;
    next_barrier = (PFN_vkCmdPipelineBarrier)next_of_device(*device, "vkCmdPipelineBarrier");
    next_barrier2 = (PFN_vkCmdPipelineBarrier2)next_of_device(*device, "vkCmdPipelineBarrier2KHR");
    next_dispatch = (PFN_vkCmdDispatch)next_of_device(*device, "vkCmdDispatch");
    next_dispatch_indirect = (PFN_vkCmdDispatchIndirect)next_of_device(*device, "vkCmdDispatchIndirect");
    drops_all = getenv("FARLIGHT_SYNC_DROP_ALL") != NULL;
    return result;
}

static VKAPI_ATTR VkResult VKAPI_CALL list_extensions(VkPhysicalDevice physical, const char *layer,
                                                      uint32_t *count, VkExtensionProperties *list)
{
    VkExtensionProperties all[EXTENSIONS_MAX];
    uint32_t all_count = EXTENSIONS_MAX, shown = 0;
    if (layer)
        return next_extensions(physical, layer, count, list);
    const VkResult result = next_extensions(physical, NULL, &all_count, all);
    if (result != VK_SUCCESS)
        return result;
    for (uint32_t i = 0; i < all_count; i++) {
        if (strcmp(all[i].extensionName, HIDDEN_EXTENSION) == 0)
            continue;
        if (list && shown == *count)
            return VK_INCOMPLETE;
        if (list)
            list[shown] = all[i];
        shown++;
    }
    *count = shown;
    return VK_SUCCESS;
}

/* Those of glMemoryBarrier(). */
static VKAPI_ATTR void VKAPI_CALL barrier(VkCommandBuffer commands, VkPipelineStageFlags source,
                                          VkPipelineStageFlags destination, VkDependencyFlags flags,
                                          uint32_t memory_count, const VkMemoryBarrier *memory,
                                          uint32_t buffer_count, const VkBufferMemoryBarrier *buffers,
                                          uint32_t image_count, const VkImageMemoryBarrier *images)
{
    if (drops_all && image_count == 0) {
        dropped++;
        return;
    }
    kept++;
    next_barrier(commands, source, destination, flags, memory_count, memory, buffer_count, buffers, image_count,
                 images);
}

static int is_between_shaders(const VkDependencyInfo *info)
{
    if (info->memoryBarrierCount != 1 || info->bufferMemoryBarrierCount != 0 || info->imageMemoryBarrierCount != 0)
        return 0;
    const VkMemoryBarrier2 *memory = info->pMemoryBarriers;
    return (memory->srcAccessMask & VK_ACCESS_2_SHADER_WRITE_BIT) && !(memory->dstAccessMask & ~SHADER_ACCESSES);
}

/* Those of zink's own. */
static VKAPI_ATTR void VKAPI_CALL barrier2(VkCommandBuffer commands, const VkDependencyInfo *info)
{
    if (is_between_shaders(info))
        dropped++;
    else
        next_barrier2(commands, info);
}

static VKAPI_ATTR void VKAPI_CALL dispatch(VkCommandBuffer commands, uint32_t x, uint32_t y, uint32_t z)
{
    dispatches++;
    next_dispatch(commands, x, y, z);
}

static VKAPI_ATTR void VKAPI_CALL dispatch_indirect(VkCommandBuffer commands, VkBuffer buffer, VkDeviceSize offset)
{
    dispatches++;
    next_dispatch_indirect(commands, buffer, offset);
}

__attribute__((destructor)) static void write_counts(void)
{
    const char *path = getenv("FARLIGHT_SYNC_COUNTS");
    FILE *file = path && dispatches ? fopen(path, "a") : NULL;
    if (!file)
        return;
    fprintf(file, "%lu %lu %lu\n", dispatches, kept, dropped);
    fclose(file);
}

static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL of_device(VkDevice device, const char *name);
static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL of_instance(VkInstance instance, const char *name);

static PFN_vkVoidFunction own_function(const char *name)
{
    static const struct {
        const char *name;
        PFN_vkVoidFunction function;
    } own[] = {
        {"vkCreateInstance", (PFN_vkVoidFunction)create_instance},
        {"vkCreateDevice", (PFN_vkVoidFunction)create_device},
        {"vkEnumerateDeviceExtensionProperties", (PFN_vkVoidFunction)list_extensions},
        {"vkGetInstanceProcAddr", (PFN_vkVoidFunction)of_instance},
        {"vkGetDeviceProcAddr", (PFN_vkVoidFunction)of_device},
        {"vkCmdPipelineBarrier", (PFN_vkVoidFunction)barrier},
        {"vkCmdPipelineBarrier2", (PFN_vkVoidFunction)barrier2},
        {"vkCmdPipelineBarrier2KHR", (PFN_vkVoidFunction)barrier2},
        {"vkCmdDispatch", (PFN_vkVoidFunction)dispatch},
        {"vkCmdDispatchIndirect", (PFN_vkVoidFunction)dispatch_indirect},
    };
    for (size_t i = 0; i < sizeof(own) / sizeof(own[0]); i++)
        if (strcmp(own[i].name, name) == 0)
            return own[i].function;
    return NULL;
}

static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL of_device(VkDevice device, const char *name)
{
    PFN_vkVoidFunction own = own_function(name);
    return own ? own : next_of_device(device, name);
}

static VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL of_instance(VkInstance instance, const char *name)
{
    PFN_vkVoidFunction own = own_function(name);
    return own ? own : next_of_instance(instance, name);
}

/* Entry point that the loader seeks; the manifest names it. */
__attribute__((visibility("default"))) VkResult farlight_sync_layer(VkNegotiateLayerInterface *interface);
VkResult farlight_sync_layer(VkNegotiateLayerInterface *interface)
{
    interface->loaderLayerInterfaceVersion = 2;
    interface->pfnGetInstanceProcAddr = of_instance;
    interface->pfnGetDeviceProcAddr = of_device;
    interface->pfnGetPhysicalDeviceProcAddr = NULL;
    return VK_SUCCESS;
}
